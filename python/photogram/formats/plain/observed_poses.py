"""Tables of positions, velocities, attitudes, rates and relative poses of photos and of trajectories."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.common_unknowns import made
from photogram.formats.plain.covariances import covariance_tables
from photogram.formats.plain.films_written import WrittenFilms
from photogram.formats.plain.groups import (
    Antenna,
    Inertial,
    antenna_columns,
    antenna_of,
    antennas,
    grouped,
    inertial_columns,
    inertial_groups,
    inertials,
)
from photogram.formats.plain.observation_tables import kind_tables, read_kinds
from photogram.formats.plain.rigs import Rigs, read_bases
from photogram.formats.plain.schema import (
    ANGLES,
    AXES,
    POSE,
    RATE,
    ROTATIONS,
    VELOCITY,
    deviation_columns,
)
from photogram.formats.plain.smoothness import read_smoothness
from photogram.formats.plain.subjects import Subjects, clocked, subject_columns
from photogram.formats.plain.tables import (
    DEGREE,
    Tables,
    angles_of,
    correlations,
    covariances_of,
    indices_of,
    places_written,
)
from photogram.formats.plain.transform import Transform
from photogram.formats.rigging import Rig
from photogram.io.delimited import ColumnTable
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.observations import Attitude, Observation, Position, Rate, Relative, Velocity

__all__ = ["observed_tables", "read_observations"]

_ROTATIONS = deviation_columns(ROTATIONS)
_ANGLES = ANGLES["omega_phi_kappa"]
_Columns = dict[str, dict[str, Any]]
_Kind = TypeVar("_Kind", bound=Observation)
_Group = TypeVar("_Group", Antenna, Inertial)


def read_observations(
    tables: Tables,
    transform: Transform,
    subjects: Subjects,
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
        *_gnss(tables, transform, subjects),
        *_velocities(tables, subjects),
        *_attitudes(tables, subjects),
        *_rates(tables, subjects),
        *read_smoothness(tables, subjects.trajectories),
        *read_kinds(tables, transform, points, subjects),
        *_relative_poses(tables, subjects.photos),
        *read_bases(tables, rigs),
    ]


def _gnss(tables: Tables, transform: Transform, subjects: Subjects) -> list[Observation]:
    table = tables.read("gnss")
    if table is None:
        return []
    of = subjects.of(tables, table)
    positions = table.vectors(AXES)
    table.check_given(positions, AXES)
    sd = tables.deviations(table, "gnss", [f"sd_{axis}" for axis in AXES])
    table.check_given(sd, [f"sd_{axis}" for axis in AXES], "is empty: give it, or gnss under [sd]")
    positions, covariances = transform.positions("gnss", positions, covariances_of(sd, table), table)
    groups, times = antennas(tables), table.numbers("time")
    found: list[Observation] = []
    for row, group, given in _timed(table, of, grouped(tables, table, groups, "gnss_groups"), Antenna()):
        if given["photo"] is not None:
            time = times[row]
            if math.isnan(time):
                time = subjects.times[subjects.photos[given["photo"]]]
            if group.drift is not None and math.isnan(time):
                raise table.error(row, "the group has a drift, and the photo no time")
            given["time"] = 0.0 if math.isnan(time) else float(time)
        given |= {"position": positions[row], "covariance": covariances[row], "lever_arm": group.lever}
        given |= {"shift": group.shift, "drift": group.drift}
        found.append(made(table, row, partial(Position, **given)))
    return found


def _velocities(tables: Tables, subjects: Subjects) -> list[Observation]:
    table = tables.read("velocities")
    if table is None:
        return []
    of = subjects.of(tables, table)
    values, covariances = _motions(tables, table, "velocities", VELOCITY)
    groups = grouped(tables, table, antennas(tables), "gnss_groups")
    found: list[Observation] = []
    for row, group, given in _timed(table, of, groups, Antenna()):
        given |= {"velocity": values[row], "covariance": covariances[row], "lever_arm": group.lever}
        found.append(made(table, row, partial(Velocity, **given)))
    return found


def _timed(
    table: ColumnTable,
    of: Sequence[dict[str, Any] | None],
    groups: Sequence[_Group | None],
    alone: _Group,
) -> Iterator[tuple[int, _Group, dict[str, Any]]]:
    """Give the rows that are used, with their groups, and by name what they observe, when, by which clock."""
    for row, (own, group) in enumerate(zip(of, groups, strict=True)):
        if own is not None:
            group = group or alone
            yield row, group, clocked(table, row, own, group.clock)


def _motions(tables: Tables, table: ColumnTable, name: str, columns: Sequence[str]) -> tuple[Floats, Floats]:
    """Return (rows, 3) velocities or rates, and (rows, 3, 3) covariances."""
    values = table.vectors(columns)
    table.check_given(values, columns)
    names = deviation_columns(columns)
    sd = tables.deviations(table, name, names)
    table.check_given(sd, names, f"is empty: give it, or {name} under [sd]")
    return values, covariances_of(sd, table, columns)


def _rates(tables: Tables, subjects: Subjects) -> list[Observation]:
    table = tables.read("rates")
    if table is None:
        return []
    of = subjects.of(tables, table)
    values, covariances = _motions(tables, table, "rates", RATE)
    # About axes that point as those of photos do.
    values, covariances = values @ tables.flip, tables.flip @ covariances @ tables.flip
    groups = grouped(tables, table, inertials(tables), "attitude_groups")
    found: list[Observation] = []
    for row, group, given in _timed(table, of, groups, Inertial()):
        given |= {"rate": values[row], "covariance": covariances[row]}
        given |= {"boresight": group.boresight, "bias": group.bias}
        found.append(made(table, row, partial(Rate, **given)))
    return found


def _attitudes(tables: Tables, subjects: Subjects) -> list[Observation]:
    table = tables.read("attitudes")
    if table is None:
        return []
    of = subjects.of(tables, table)
    matrices = tables.matrices(table)
    given_sd = tables.settings.sd.get("attitudes")
    sd = table.vectors(_ROTATIONS, read=tables.angle)
    if given_sd is not None:
        defaults = np.broadcast_to([tables.angle(repr(each)) for each in given_sd], 3)
        sd = np.where(np.isnan(sd), defaults, sd)
    table.check_given(sd, _ROTATIONS, "is empty: give it, or attitudes under [sd]")
    unknown = np.isnan(matrices).any(axis=(1, 2))
    if unknown.any():
        raise table.error(int(np.argmax(unknown)), "there is no attitude")
    covariances = tables.flip @ covariances_of(sd, table, ROTATIONS, (tables.radians,) * 3) @ tables.flip
    groups = grouped(tables, table, inertials(tables), "attitude_groups")
    found: list[Observation] = []
    for row, group, given in _timed(table, of, groups, Inertial()):
        given |= {"attitude": matrices[row], "covariance": covariances[row], "boresight": group.boresight}
        found.append(made(table, row, partial(Attitude, **given)))
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


def observed_tables(block: Block, cameras: Sequence[Camera], rigs: Rigs, films: WrittenFilms) -> _Columns:
    """Return the tables of all observations beside images, of what they have in common, and of rigs."""
    return {
        **_antenna_tables(block),
        **_inertial_tables(block),
        **kind_tables(block),
        **_pose_tables(block),
        **rigs.tables(block),
        **films.tables(),
        **covariance_tables(block, cameras, rigs, films.covariances()),
    }


def _all(block: Block, kind: type[_Kind]) -> list[_Kind]:
    return [each for each in block.observations if isinstance(each, kind)]


def _columns(names: Sequence[str], values: Floats) -> dict[str, Any]:
    return dict(zip(names, values.T, strict=True))


def _deviations(observations: Sequence[Observation]) -> Floats:
    """Return (n, k) standard deviations of observations."""
    found: Floats = np.sqrt(np.array([np.diag(each.precision) for each in observations]))
    return found


def _measured(observations: Sequence[Observation], columns: Sequence[str], values: Floats) -> dict[str, Any]:
    """Return the columns of what was observed, with deviations and covariances of components."""
    precisions = np.array([each.precision for each in observations])
    return {
        **_columns(columns, values),
        **_columns(deviation_columns(columns), _deviations(observations)),
        **correlations(precisions, columns),
    }


def _antenna_tables(block: Block) -> _Columns:
    """Return the tables of positions and velocities, and of their groups."""
    positions, velocities = _all(block, Position), _all(block, Velocity)
    if not positions and not velocities:
        return {}
    keys = [*map(antenna_of, positions), *map(antenna_of, velocities)]
    groups = {key: str(row) for row, key in enumerate(dict.fromkeys(keys), 1)}
    found: _Columns = {}
    if positions:
        places = places_written(block, np.array([each.observed[:3] for each in positions]))
        found["gnss"] = subject_columns(positions, block) | _measured(positions, AXES, places)
    if velocities:
        values = np.array([each.observed[:3] for each in velocities])
        found["velocities"] = subject_columns(velocities, block) | _measured(velocities, VELOCITY, values)
    if list(groups) == [Antenna()]:
        return found
    names = [groups[key] for key in keys]
    for table, own in (("gnss", names[: len(positions)]), ("velocities", names[len(positions) :])):
        if own:
            found[table]["group"] = own
    return found | {"gnss_groups": antenna_columns(groups)}


def _inertial_tables(block: Block) -> _Columns:
    """Return the tables of attitudes and rates, and of their groups."""
    attitudes, rates = _all(block, Attitude), _all(block, Rate)
    names, groups = inertial_groups([*attitudes, *rates])
    found: _Columns = {}
    if attitudes:
        angles = angles_of(np.array([np.asarray(each.attitude) for each in attitudes]), block)
        covariances = np.array([each.precision for each in attitudes])
        found["attitudes"] = {
            **subject_columns(attitudes, block),
            **_columns(_ANGLES, angles),
            **_columns(_ROTATIONS, np.degrees(_deviations(attitudes))),
            **correlations(covariances, ROTATIONS, (DEGREE,) * 3),
        }
    if rates:
        values = np.array([each.observed[:3] for each in rates])
        found["rates"] = subject_columns(rates, block) | _measured(rates, RATE, values)
    if not groups:
        return found
    for table, own in (("attitudes", names[: len(attitudes)]), ("rates", names[len(attitudes) :])):
        if own:
            found[table]["group"] = own
    return found | {"attitude_groups": inertial_columns(groups, block)}


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
