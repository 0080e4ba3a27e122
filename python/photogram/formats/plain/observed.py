"""Tables of positions, attitudes and relative poses of photos, with what they have in common."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.covariances import covariance_tables, word_of
from photogram.formats.plain.kinds import kind_tables, read_kinds
from photogram.formats.plain.rigs import Rigs, angles_of, read_bases
from photogram.formats.plain.schema import ANGLES, AXES, POSE, ROTATIONS, deviation_columns
from photogram.formats.plain.tables import (
    DEGREE,
    Tables,
    correlations,
    covariances_of,
    indices_of,
    made,
    places_written,
)
from photogram.formats.plain.transform import Transform
from photogram.formats.rigging import Rig
from photogram.io.delimited import FALSE, TRUE
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.observations import Attitude, Observation, Position, Relative
from photogram.network.unknowns import Boresight, Drift, LeverArm, Shift, Unknown

__all__ = ["observed_tables", "read_observations"]

_Shared = TypeVar("_Shared", LeverArm, Shift, Drift)
_ROTATIONS = deviation_columns(ROTATIONS)
_ANGLES = ANGLES["omega_phi_kappa"]
_Columns = dict[str, dict[str, Any]]
_Kind = TypeVar("_Kind", bound=Observation)


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
        *read_kinds(tables, transform, points),
        *_relative_poses(tables, photos),
        *read_bases(tables, rigs),
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
    positions = table.vectors(AXES)
    table.check_given(positions, AXES)
    sd = tables.deviations(table, "gnss", [f"sd_{axis}" for axis in AXES])
    table.check_given(sd, [f"sd_{axis}" for axis in AXES], "is empty: give it, or gnss under [sd]")
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
    zeros |= {kind: table.vectors([f"{kind}_{axis}" for axis in AXES], 0.0) for kind in ("shift", "drift")}
    sd = {
        kind: table.vectors([f"sd_{kind}_{axis}" for axis in AXES], default, infinite=True)
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
    sd = table.vectors(_ROTATIONS, read=tables.angle)
    if given is not None:
        defaults = np.broadcast_to([tables.angle(repr(each)) for each in given], 3)
        sd = np.where(np.isnan(sd), defaults, sd)
    table.check_given(sd, _ROTATIONS, "is empty: give it, or attitudes under [sd]")
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
    sd = table.vectors(_ROTATIONS, math.inf, infinite=True, read=tables.angle)
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


def _relative_poses(tables: Tables, photos: Mapping[str, int]) -> list[Observation]:
    table = tables.read("relative_poses")
    if table is None:
        return []
    names = list(photos)
    first, second = (indices_of(table, column, photos, "photo").tolist() for column in ("from", "to"))
    vectors, turns = tables.vectors(table, AXES), tables.turns(table)
    table.check_given(vectors, AXES)
    lengths = tables.deviations(table, "relative_poses", [f"sd_{axis}" for axis in AXES])
    angles = table.vectors(_ROTATIONS, read=tables.angle)
    sd = np.column_stack([lengths, angles])
    table.check_given(sd, [f"sd_{name}" for name in POSE])
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


def observed_tables(block: Block, cameras: Sequence[Camera], photo_cameras: Sequence[int]) -> _Columns:
    """Return the tables of all observations beside images, of what they have in common, and of rigs."""
    rigs = Rigs(block, [cameras[row].name for row in photo_cameras])
    return {
        **_gnss_tables(block),
        **_attitude_tables(block),
        **kind_tables(block),
        **_pose_tables(block),
        **rigs.tables(block),
        **covariance_tables(block, cameras, rigs),
    }


def _all(block: Block, kind: type[_Kind]) -> list[_Kind]:
    return [each for each in block.observations if isinstance(each, kind)]


def _columns(names: Sequence[str], values: Floats) -> dict[str, Any]:
    return dict(zip(names, values.T, strict=True))


def _deviations(observations: Sequence[Observation]) -> Floats:
    """Return (n, k) standard deviations of observations."""
    found: Floats = np.sqrt(np.array([np.diag(each.precision) for each in observations]))
    return found


def _gnss_tables(block: Block) -> _Columns:
    positions = _all(block, Position)
    if not positions:
        return {}
    keys = [(_lever(each), each.shift, each.drift) for each in positions]
    groups = {key: str(row) for row, key in enumerate(dict.fromkeys(keys), 1)}
    covariances = np.array([each.precision for each in positions])
    table: dict[str, Any] = {
        "photo": [each.photo for each in positions],
        **_columns(AXES, places_written(block, np.array([each.observed[:3] for each in positions]))),
        **_columns([f"sd_{axis}" for axis in AXES], _deviations(positions)),
        **correlations(covariances, AXES),
    }
    if list(groups) == [((0.0, 0.0, 0.0), None, None)]:
        return {"gnss": table}
    table["group"] = [groups[key] for key in keys]
    levers = [key[0] if isinstance(key[0], LeverArm) else None for key in groups]
    own: dict[str, Any] = {
        "group": list(groups.values()),
        "lever": ["" if each is None else each.name for each in levers],
        "shift": [word_of(key[1]) for key in groups],
        "drift": [word_of(key[2]) for key in groups],
    }
    known = np.array(
        [(0.0,) * 3 if each is not None else key[0] for each, key in zip(levers, groups, strict=True)]
    )
    given = [each.position if each is not None else row for each, row in zip(levers, known, strict=True)]
    own |= _columns([f"lever_{axis}" for axis in AXES], np.array(given))
    own |= _columns([f"sd_lever_{axis}" for axis in AXES], _of(levers, "deviations", 0.0))
    for what, column in (("shift", 1), ("drift", 2)):
        unknowns = [key[column] for key in groups]
        own |= _columns([f"{what}_{axis}" for axis in AXES], _of(unknowns, "position", np.nan))
        own |= _columns([f"sd_{what}_{axis}" for axis in AXES], _of(unknowns, "deviations", np.nan))
    epochs = [None if drift is None else drift.epoch for _, _, drift in groups]
    if any(each is not None for each in epochs):
        own["drift_epoch"] = np.array([np.nan if each is None else each for each in epochs])
    return {"gnss": table, "gnss_groups": own}


def _of(unknowns: Sequence[Unknown | None], what: str, missing: float) -> Floats:
    """Return (n, 3) numbers of unknowns."""
    return np.array([(missing,) * 3 if each is None else getattr(each, what) for each in unknowns])


def _lever(each: Position) -> Any:
    if isinstance(each.lever_arm, LeverArm):
        return each.lever_arm
    return tuple(np.broadcast_to(np.asarray(each.lever_arm, dtype=float), 3).tolist())


def _attitude_tables(block: Block) -> _Columns:
    attitudes = _all(block, Attitude)
    if not attitudes:
        return {}
    groups = {id(each.boresight): each.boresight for each in attitudes if each.boresight is not None}
    names = {
        key: each.name if isinstance(each, Boresight) else f"known {row}"
        for row, (key, each) in enumerate(groups.items(), 1)
    }
    covariances = np.array([each.precision for each in attitudes])
    table: dict[str, Any] = {
        "photo": [each.photo for each in attitudes],
        **_columns(_ANGLES, angles_of(np.array([np.asarray(each.attitude) for each in attitudes]), block)),
        **_columns([f"sd_{name}" for name in ROTATIONS], np.degrees(_deviations(attitudes))),
        **correlations(covariances, ROTATIONS, (DEGREE,) * 3),
    }
    if not groups:
        return {"attitudes": table}
    table["group"] = [names.get(id(each.boresight), "") for each in attitudes]
    given = list(groups.values())
    # The boresight is body to photo; the tables have attitudes of the photo in the axes of what carries it.
    matrices = np.array(
        [each.attitude if isinstance(each, Boresight) else np.asarray(each, dtype=float) for each in given]
    ).transpose(0, 2, 1)
    angles = angles_of(matrices, block)
    angles[[isinstance(each, Boresight) and each.is_open for each in given]] = np.nan
    sd = np.array([each.deviations if isinstance(each, Boresight) else np.zeros(3) for each in given])
    own: dict[str, Any] = {"group": list(names.values()), **_columns(_ANGLES, angles)}
    own |= _columns([f"sd_{name}" for name in ROTATIONS], np.degrees(sd))
    return {"attitudes": table, "attitude_groups": own}


def _pose_tables(block: Block) -> _Columns:
    poses = _all(block, Relative)
    if not poses:
        return {}
    units = (1.0,) * 3 + (DEGREE,) * 3
    return {
        "relative_poses": {
            "from": [each.first for each in poses],
            "to": [each.second for each in poses],
            **_columns(AXES, np.array([np.asarray(each.translation) for each in poses])),
            **_columns(_ANGLES, angles_of(np.array([np.asarray(each.rotation) for each in poses]), block)),
            **_columns([f"sd_{name}" for name in POSE], _deviations(poses) * units),
            **correlations(np.array([each.precision for each in poses]), POSE, units),
        }
    }
