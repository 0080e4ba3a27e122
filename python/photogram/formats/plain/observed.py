"""Tables of what was observed beside images: GNSS, attitudes, distances, differences of coordinates."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.plain.tables import AXES, Tables, covariances_of, indices_of
from photogram.formats.plain.transform import Transform
from photogram.io.delimited import ColumnTable
from photogram.network.observations import Attitude, Difference, Distance, Observation, Position
from photogram.network.unknowns import Boresight, Drift, LeverArm, Shift

__all__ = ["read_observations"]

_Made = TypeVar("_Made")
_ROTATIONS = ("sd_rotation_x", "sd_rotation_y", "sd_rotation_z")


def read_observations(
    tables: Tables,
    transform: Transform,
    photos: Mapping[str, int],
    times: Sequence[float],
    points: Mapping[str, int],
) -> list[Observation]:
    """Read all tables of observations beside images.

    Raises
    ------
    InputError
        Names that are not there, values that give no observation.
    """
    return [
        *_gnss(tables, transform, photos, times),
        *_attitudes(tables, photos),
        *_distances(tables, points),
        *_differences(tables, points),
    ]


@dataclass
class _Group:
    """What the observations of a group of GNSS positions have in common."""

    lever: Floats | LeverArm = field(default_factory=lambda: np.zeros(3))
    shift: Shift | None = None
    drift: Drift | None = None


def _gnss(
    tables: Tables, transform: Transform, photos: Mapping[str, int], times: Sequence[float]
) -> list[Observation]:
    table = tables.read("gnss")
    if table is None:
        return []
    rows = indices_of(table, "photo", photos, "photo")
    positions = np.stack([table.numbers(axis) for axis in AXES], axis=1)
    _check_given(table, positions, AXES)
    sd = tables.deviations(table, "gnss", [f"sd_{axis}" for axis in AXES])
    _check_given(table, sd, [f"sd_{axis}" for axis in AXES], "is empty: give it, or gnss under [sd]")
    covariances = covariances_of(sd, table)
    positions, covariances = transform.positions("gnss", positions, covariances, table)
    groups = _gnss_groups(tables)
    names = table.texts("group")
    own_times = table.numbers("time")
    names_of = list(photos)
    found: list[Observation] = []
    for row, photo in enumerate(rows.tolist()):
        if names[row] and names[row] not in groups and tables.settings.tables.get("gnss_groups"):
            raise table.error(row, f"column group: there is no group {names[row]} in the table gnss_groups")
        group = groups.get(names[row], _Group())
        time = own_times[row] if not math.isnan(own_times[row]) else times[photo]
        if group.drift is not None and math.isnan(time):
            raise table.error(row, "the group has a drift, and the photo no time")
        found.append(
            _made(
                table,
                row,
                lambda photo=photo, row=row, group=group, time=time: Position(  # type: ignore[misc]
                    names_of[photo],
                    positions[row],
                    covariance=covariances[row],
                    lever_arm=group.lever,
                    shift=group.shift,
                    drift=group.drift,
                    time=0.0 if math.isnan(time) else float(time),
                ),
            )
        )
    return found


def _gnss_groups(tables: Tables) -> dict[str, _Group]:
    table = tables.read("gnss_groups")
    if table is None:
        return {}
    found = {}
    switches = {name: table.flags(name, False) for name in ("shift", "drift")}
    columns = {
        kind: np.stack([table.numbers(f"{kind}_{axis}", default, infinite=True) for axis in AXES], axis=1)
        for kind, default in (
            ("lever", 0.0),
            ("sd_lever", 0.0),
            ("sd_shift", math.inf),
            ("sd_drift", math.inf),
        )
    }
    for row, name in enumerate(table.texts("group")):
        if name in found:
            raise table.error(row, f"the group {name} is there twice")
        own = _Group(columns["lever"][row])
        title = name or "GNSS"

        def fill(own: _Group = own, title: str = title, row: int = row) -> None:
            if columns["sd_lever"][row].any():
                own.lever = LeverArm(title, columns["lever"][row], columns["sd_lever"][row])
            if switches["shift"][row]:
                own.shift = Shift(title, sd=columns["sd_shift"][row])
            if switches["drift"][row]:
                own.drift = Drift(title, sd=columns["sd_drift"][row])

        _made(table, row, fill)
        found[name] = own
    return found


def _attitudes(tables: Tables, photos: Mapping[str, int]) -> list[Observation]:
    table = tables.read("attitudes")
    if table is None:
        return []
    rows = indices_of(table, "photo", photos, "photo")
    matrices = tables.matrices(table)
    given = tables.settings.sd.get("attitudes")
    sd = np.stack([table.numbers(name, read=tables.angle) for name in _ROTATIONS], axis=1)
    if given is not None:
        defaults = np.broadcast_to([tables.angle(repr(each)) for each in given], 3)
        sd = np.where(np.isnan(sd), defaults, sd)
    _check_given(table, sd, _ROTATIONS, "is empty: give it, or attitudes under [sd]")
    boresights = _attitude_groups(tables)
    groups, names = table.texts("group"), list(photos)
    for row in range(table.count):
        if np.isnan(matrices[row]).any():
            raise table.error(row, "there is no attitude")
        if groups[row] and groups[row] not in boresights:
            raise table.error(
                row, f"column group: there is no group {groups[row]} in the table attitude_groups"
            )
    return [
        _made(
            table,
            row,
            lambda row=row, photo=photo: Attitude(  # type: ignore[misc]
                names[photo], matrices[row], sd=sd[row], boresight=boresights.get(groups[row])
            ),
        )
        for row, photo in enumerate(rows.tolist())
    ]


def _attitude_groups(tables: Tables) -> dict[str, Boresight]:
    table = tables.read("attitude_groups")
    if table is None:
        return {}
    matrices = tables.matrices(table)
    sd = np.stack(
        [table.numbers(name, math.inf, infinite=True, read=tables.angle) for name in _ROTATIONS], axis=1
    )
    found: dict[str, Boresight] = {}
    for row, name in enumerate(table.texts("group")):
        if name in found:
            raise table.error(row, f"the group {name} is there twice")
        matrix = np.eye(3) if np.isnan(matrices[row]).any() else matrices[row].T
        found[name] = _made(
            table,
            row,
            lambda name=name, matrix=matrix, row=row: Boresight(name or "IMU", matrix, sd[row]),  # type: ignore[misc]
        )
    return found


def _distances(tables: Tables, points: Mapping[str, int]) -> list[Observation]:
    table = tables.read("distances")
    if table is None:
        return []
    first, second = _ends(table, points)
    lengths = table.numbers("distance")
    sd = tables.deviations(table, "distances", ["sd"])[:, 0]
    _check_given(table, np.column_stack([lengths, sd]), ("distance", "sd"))

    def distance(row: int) -> Distance:
        return Distance(first[row], second[row], float(lengths[row]), float(sd[row]))

    return [_made(table, row, partial(distance, row)) for row in range(table.count)]


def _differences(tables: Tables, points: Mapping[str, int]) -> list[Observation]:
    found: list[Observation] = []
    for name, columns in (("height_differences", ("dz",)), ("coordinate_differences", ("dx", "dy", "dz"))):
        table = tables.read(name)
        if table is None:
            continue
        first, second = _ends(table, points)
        vectors = np.full((table.count, 3), np.nan)
        vectors[:, 3 - len(columns) :] = np.stack([table.numbers(each) for each in columns], axis=1)
        sd = np.full((table.count, 3), np.nan)
        own = ["sd"] if len(columns) == 1 else [f"sd_{each}" for each in columns]
        sd[:, 3 - len(columns) :] = tables.deviations(table, name, own)
        found += [
            _made(
                table,
                row,
                lambda row=row, first=first, second=second, vectors=vectors, sd=sd: Difference(  # type: ignore[misc]
                    first[row], second[row], vectors[row], sd=np.where(np.isnan(vectors[row]), 1.0, sd[row])
                ),
            )
            for row in range(table.count)
        ]
    return found


def _ends(table: ColumnTable, points: Mapping[str, int]) -> tuple[list[str], list[str]]:
    names = list(points)
    first, second = (indices_of(table, column, points, "point").tolist() for column in ("from", "to"))
    return [names[row] for row in first], [names[row] for row in second]


def _check_given(table: ColumnTable, values: Floats, columns: Sequence[str], why: str = "is empty") -> None:
    missing = np.argwhere(np.isnan(values))
    if len(missing):
        row, column = missing[0].tolist()
        raise table.error(row, f"column {columns[column]}: {why}")


def _made(table: ColumnTable, row: int, make: Callable[[], _Made]) -> _Made:
    """Make something of a row; what it refuses is an error of the row."""
    try:
        return make()
    except InputError as error:
        raise (error if error.file else table.error(row, error.message)) from None
