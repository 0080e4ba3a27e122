"""Tables of what was observed beside images, but for points on surfaces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.rows import check_given, made
from photogram.formats.plain.schema import AXES, POSE, ROTATIONS
from photogram.formats.plain.surfaces import read_surfaces
from photogram.formats.plain.tables import Tables, covariances_of, indices_of
from photogram.formats.plain.transform import Transform
from photogram.formats.rigging import Rig
from photogram.io.delimited import FALSE, TRUE, ColumnTable
from photogram.messages import quoted
from photogram.network.observations import (
    Attitude,
    Base,
    Difference,
    Distance,
    EqualHeight,
    Observation,
    Position,
    Relative,
)
from photogram.network.unknowns import Boresight, Drift, Instrument, LeverArm, Shift, Unknown

__all__ = ["read_observations"]

_Shared = TypeVar("_Shared", LeverArm, Shift, Drift)
_ROTATIONS = tuple(f"sd_{name}" for name in ROTATIONS)


def read_observations(
    tables: Tables,
    transform: Transform,
    photos: Mapping[str, int],
    times: Sequence[float],
    points: Mapping[str, int],
    rigs: Mapping[str, Rig],
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
        *_height_differences(tables, points),
        *_coordinate_differences(tables, points),
        *read_surfaces(tables, transform, points),
        *_relative_poses(tables, photos),
        *_bases(tables, rigs),
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
    check_given(table, positions, AXES)
    sd = tables.deviations(table, "gnss", [f"sd_{axis}" for axis in AXES])
    check_given(table, sd, [f"sd_{axis}" for axis in AXES], "is empty: give it, or gnss under [sd]")
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
            made(
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
    zeros = {"lever": tables.vectors(table, [f"lever_{axis}" for axis in AXES], 0.0)}
    zeros |= {
        kind: np.stack([table.numbers(f"{kind}_{axis}", 0.0) for axis in AXES], axis=1)
        for kind in ("shift", "drift")
    }
    sd = {
        kind: np.stack([table.numbers(f"sd_{kind}_{axis}", default, infinite=True) for axis in AXES], axis=1)
        for kind, default in (("lever", 0.0), ("shift", math.inf), ("drift", math.inf))
    }
    epochs = [None if math.isnan(each) else float(each) for each in table.numbers("drift_epoch")]
    shared: dict[tuple[type[Unknown], str], Unknown] = {}

    where = table

    def one(kind: type[_Shared], what: str, row: int, name: str) -> _Shared:
        """Return what a group has, the same object for all groups that name it."""
        value, deviations = zeros[what][row], sd[what][row]
        further = {"epoch": epochs[row]} if kind is Drift else {}
        make = partial(kind, name, value, deviations, **further)
        own = shared.setdefault((kind, name), made(where, row, make))
        same = not further or getattr(own, "epoch", None) == epochs[row]
        if not (same and np.array_equal(own.position, value) and np.array_equal(own.deviations, deviations)):
            raise where.error(row, f"column {what}: {name} has other values in a row before")
        assert isinstance(own, kind)
        return own

    found: dict[str, _Group] = {}
    for row, (name, lever, shift, drift) in enumerate(
        zip(*(table.texts(column) for column in ("group", "lever", "shift", "drift")), strict=True)
    ):
        if name in found:
            raise table.error(row, f"the group {name} is there twice")
        title = name or "GNSS"
        own = _Group(zeros["lever"][row])
        if sd["lever"][row].any():
            own.lever = one(LeverArm, "lever", row, lever or title)
        if called := _called(shift, title):
            own.shift = one(Shift, "shift", row, called)
        if called := _called(drift, title):
            own.drift = one(Drift, "drift", row, called)
        found[name] = own
    return found


def _called(cell: str, title: str) -> str:
    """Return the name of a shift or drift: that of the group for `true`, none for `false`, else its own."""
    word = cell.lower()
    return title if word in TRUE else "" if word in FALSE else cell


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
    check_given(table, sd, _ROTATIONS, "is empty: give it, or attitudes under [sd]")
    boresights = _attitude_groups(tables)
    groups, names = table.texts("group"), list(photos)
    for row in range(table.count):
        if np.isnan(matrices[row]).any():
            raise table.error(row, "there is no attitude")
        if groups[row] and groups[row] not in boresights:
            raise table.error(
                row, f"column group: there is no group {groups[row]} in the table attitude_groups"
            )
    covariances = covariances_of(sd, table, ROTATIONS, (tables.radians,) * 3)
    return [
        made(
            table,
            row,
            lambda row=row, photo=photo: Attitude(  # type: ignore[misc]
                names[photo],
                matrices[row],
                covariance=covariances[row],
                boresight=boresights.get(groups[row]),
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
        matrix = None if np.isnan(matrices[row]).any() else matrices[row].T
        found[name] = made(
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
    check_given(table, np.column_stack([lengths, sd]), ("distance", "sd"))
    known, names = _instruments(tables), table.texts("instrument")

    def distance(row: int) -> Distance:
        if names[row] and names[row] not in known:
            known[names[row]] = Instrument(names[row])
        return Distance(first[row], second[row], float(lengths[row]), float(sd[row]), known.get(names[row]))

    return [made(table, row, partial(distance, row)) for row in range(table.count)]


def _instruments(tables: Tables) -> dict[str, Instrument]:
    """Return instruments; one that only the distances name has a free scale and constant."""
    table = tables.read("instruments")
    if table is None:
        return {}
    table.names("instrument")
    scale, constant = table.numbers("scale", 1.0), table.numbers("constant", 0.0)
    sd = np.stack(
        [table.numbers(name, math.inf, infinite=True) for name in ("sd_scale", "sd_constant")], axis=1
    )
    found: dict[str, Instrument] = {}
    for row, name in enumerate(table.texts("instrument")):
        if name in found:
            raise table.error(row, f"the instrument {name} is there twice")
        found[name] = made(
            table,
            row,
            partial(Instrument, name, float(scale[row]), float(constant[row]), sd[row]),
        )
    return found


def _height_differences(tables: Tables, points: Mapping[str, int]) -> list[Observation]:
    table = tables.read("height_differences")
    if table is None:
        return []
    first, second = _ends(table, points)
    heights, sd = table.numbers("dz"), tables.deviations(table, "height_differences", ["sd"])[:, 0]
    check_given(table, np.column_stack([heights, sd]), ("dz", "sd"))
    return [
        made(table, row, partial(EqualHeight, first[row], second[row], float(sd[row]), float(heights[row])))
        for row in range(table.count)
    ]


def _coordinate_differences(tables: Tables, points: Mapping[str, int]) -> list[Observation]:
    table = tables.read("coordinate_differences")
    if table is None:
        return []
    first, second = _ends(table, points)
    columns = ("dx", "dy", "dz")
    vectors = np.stack([table.numbers(each) for each in columns], axis=1)
    sd = tables.deviations(table, "coordinate_differences", [f"sd_{each}" for each in columns])
    check_given(table, np.where(np.isnan(vectors), 0.0, sd), [f"sd_{each}" for each in columns])
    covariances = covariances_of(np.where(np.isnan(vectors), 1.0, sd), table, columns)
    return [
        made(
            table,
            row,
            partial(Difference, first[row], second[row], vectors[row], covariance=covariances[row]),
        )
        for row in range(table.count)
    ]


def _relative_poses(tables: Tables, photos: Mapping[str, int]) -> list[Observation]:
    table = tables.read("relative_poses")
    if table is None:
        return []
    names = list(photos)
    first, second = (indices_of(table, column, photos, "photo").tolist() for column in ("from", "to"))
    vectors, turns = tables.vectors(table, AXES), tables.turns(table)
    check_given(table, vectors, AXES)
    lengths = tables.deviations(table, "relative_poses", [f"sd_{axis}" for axis in AXES])
    angles = np.stack([table.numbers(name, read=tables.angle) for name in _ROTATIONS], axis=1)
    sd = np.column_stack([lengths, angles])
    check_given(table, sd, [f"sd_{name}" for name in POSE])
    covariances = tables.pose_covariances(table, sd)
    for row in np.flatnonzero(np.isnan(turns).any(axis=(1, 2))).tolist():
        raise table.error(row, "there are no angles")
    return [
        made(
            table,
            row,
            partial(
                Relative,
                names[first[row]],
                names[second[row]],
                vectors[row],
                turns[row],
                covariance=covariances[row],
            ),
        )
        for row in range(table.count)
    ]


def _bases(tables: Tables, rigs: Mapping[str, Rig]) -> list[Observation]:
    table = tables.read("bases")
    if table is None:
        return []
    lengths = table.numbers("distance")
    sd = tables.deviations(table, "bases", ["sd"])[:, 0]
    check_given(table, np.column_stack([lengths, sd]), ("distance", "sd"))
    found: list[Observation] = []
    for row, (name, *ends) in enumerate(
        zip(*(table.texts(column) for column in ("rig", "from", "to")), strict=True)
    ):
        if name not in rigs:
            raise table.error(row, f"column rig: there is no rig {quoted(name)}")
        rig = rigs[name]
        for column, end in zip(("from", "to"), ends, strict=True):
            if end != rig.reference and end not in rig.sensors:
                raise table.error(row, f"column {column}: the rig {name} has no camera {quoted(end)}")
        # The reference is the frame: what lies between two cameras has no direction.
        first, second = sorted(ends, key=lambda end: end != rig.reference)
        if first == second:
            raise table.error(row, f"a base from {first} to itself")
        found.append(
            made(
                table,
                row,
                partial(
                    Base, rig.sensors.get(first), rig.sensors[second], float(lengths[row]), float(sd[row])
                ),
            )
        )
    return found


def _ends(table: ColumnTable, points: Mapping[str, int]) -> tuple[list[str], list[str]]:
    names = list(points)
    first, second = (indices_of(table, column, points, "point").tolist() for column in ("from", "to"))
    return [names[row] for row in first], [names[row] for row in second]
