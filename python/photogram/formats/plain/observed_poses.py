"""Tables of positions, velocities, attitudes, rates and relative poses of photos and of trajectories."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
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
    AXES,
    OPK,
    POSE,
    RATE,
    ROTATIONS,
    SD_ROTATIONS,
    VELOCITY,
    deviation_columns,
)
from photogram.formats.plain.subjects import Subjects, clocked, subject_columns
from photogram.formats.plain.tables import (
    DEGREE,
    Tables,
    angles_of,
    columns_of,
    correlations,
    covariances_of,
    indices_of,
    places_written,
)
from photogram.formats.plain.trajectories import read_smoothness
from photogram.formats.plain.transform import Transform
from photogram.formats.rigging import Rig
from photogram.io.column_table import ColumnTable
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.observations import Attitude, Observation, Position, Rate, Relative, Velocity
from photogram.words import phrase

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
    """Read all tables of observations beside images."""
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
    measured = transform.positions("gnss", *_measured(tables, table, "gnss", AXES), table)
    groups, times = grouped(tables, table, antennas(tables), "gnss_groups"), table.numbers("time")
    found: list[Observation] = []
    for row, group, given in _used(table, of, groups, Antenna(), "position", *measured):
        if given["photo"] is not None:
            time = times[row]
            if math.isnan(time):
                time = subjects.times[subjects.photos[given["photo"]]]
            if group.drift is not None and math.isnan(time):
                raise table.error(row, phrase("plain.drift-without-time"))
            given["time"] = 0.0 if math.isnan(time) else float(time)
        given |= {"lever_arm": group.lever, "shift": group.shift, "drift": group.drift}
        found.append(made(table, row, Position, **given))
    return found


def _velocities(tables: Tables, subjects: Subjects) -> list[Observation]:
    table = tables.rows("velocities")
    of = subjects.of(tables, table)
    measured = _measured(tables, table, "velocities", VELOCITY)
    groups = grouped(tables, table, antennas(tables), "gnss_groups")
    return [
        made(table, row, Velocity, **given, lever_arm=group.lever)
        for row, group, given in _used(table, of, groups, Antenna(), "velocity", *measured)
    ]


def _used(
    table: ColumnTable,
    of: Sequence[dict[str, Any] | None],
    groups: Sequence[_Group | None],
    alone: _Group,
    what: str,
    values: Floats,
    covariances: Floats,
) -> Iterator[tuple[int, _Group, dict[str, Any]]]:
    """Yield the rows that are used, with their groups, and by name what they are of and what was observed."""
    for row, (own, group) in enumerate(zip(of, groups, strict=True)):
        if own is not None:
            group = group or alone
            given = clocked(table, row, own, group.clock)
            yield row, group, given | {what: values[row], "covariance": covariances[row]}


def _measured(tables: Tables, table: ColumnTable, name: str, columns: Sequence[str]) -> tuple[Floats, Floats]:
    """Return (rows, 3) what was observed, and (rows, 3, 3) covariances."""
    values, names = table.given(columns), deviation_columns(columns)
    sd = tables.deviations(table, name, names)
    table.check_given(sd, names, f"is empty: give it, or {name} under [sd]")
    return values, covariances_of(sd, table, columns)


def _rates(tables: Tables, subjects: Subjects) -> list[Observation]:
    table = tables.rows("rates")
    of = subjects.of(tables, table)
    values, covariances = _measured(tables, table, "rates", RATE)
    # About axes that point as those of photos do.
    measured = values @ tables.flip, tables.flip @ covariances @ tables.flip
    groups = grouped(tables, table, inertials(tables), "attitude_groups")
    return [
        made(table, row, Rate, **given, boresight=group.boresight, bias=group.bias)
        for row, group, given in _used(table, of, groups, Inertial(), "rate", *measured)
    ]


def _attitudes(tables: Tables, subjects: Subjects) -> list[Observation]:
    table = tables.rows("attitudes")
    of = subjects.of(tables, table)
    given_sd = tables.settings.sd.get("attitudes")
    sd = table.vectors(SD_ROTATIONS, read=tables.angle)
    if given_sd is not None:
        sd = np.where(np.isnan(sd), [tables.angle(repr(each)) for each in given_sd], sd)
    table.check_given(sd, SD_ROTATIONS, "is empty: give it, or attitudes under [sd]")
    matrices = tables.known_matrices(table, "there is no attitude")
    covariances = tables.flip @ covariances_of(sd, table, ROTATIONS, (tables.radians,) * 3) @ tables.flip
    groups = grouped(tables, table, inertials(tables), "attitude_groups")
    return [
        made(table, row, Attitude, **given, boresight=group.boresight)
        for row, group, given in _used(table, of, groups, Inertial(), "attitude", matrices, covariances)
    ]


def _relative_poses(tables: Tables, photos: Mapping[str, int]) -> list[Observation]:
    table, names = tables.rows("relative_poses"), list(photos)
    first, second = (indices_of(table, column, photos, "photo").tolist() for column in ("from", "to"))
    vectors = table.given(AXES) @ tables.flip
    lengths = tables.deviations(table, "relative_poses", deviation_columns(AXES))
    angles = table.vectors(SD_ROTATIONS, read=tables.angle)
    sd = np.column_stack([lengths, angles])
    table.check_given(sd, deviation_columns(POSE))
    covariances, turns = tables.pose_covariances(table, sd), tables.flip @ tables.known_matrices(table)
    given = zip(first, second, vectors, turns, covariances, strict=True)
    return [
        made(table, row, Relative, names[one], names[other], vector, turn, covariance=covariance)
        for row, (one, other, vector, turn, covariance) in enumerate(given)
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


def _written(
    observations: Sequence[Observation],
    names: Sequence[str],
    values: Floats,
    components: Sequence[str] = (),
    units: Sequence[float] | None = None,
) -> dict[str, Any]:
    """Return the columns of what was observed, with deviations and covariances of its components."""
    components = components or names
    precisions = np.array([each.precision for each in observations])
    sd = np.sqrt(np.einsum("nii->ni", precisions)) * (1.0 if units is None else units)
    return {
        **columns_of(names, values),
        **columns_of(deviation_columns(components), sd),
        **correlations(precisions, components, units),
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
        found["gnss"] = subject_columns(positions, block) | _written(positions, AXES, places)
    if velocities:
        values = np.array([each.observed[:3] for each in velocities])
        found["velocities"] = subject_columns(velocities, block) | _written(velocities, VELOCITY, values)
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
        turned = _written(attitudes, OPK, angles, ROTATIONS, (DEGREE,) * 3)
        found["attitudes"] = subject_columns(attitudes, block) | turned
    if rates:
        values = np.array([each.observed[:3] for each in rates])
        found["rates"] = subject_columns(rates, block) | _written(rates, RATE, values)
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
    values = np.hstack(
        [
            np.array([np.asarray(each.translation) for each in poses]),
            angles_of(np.array([np.asarray(each.rotation) for each in poses]), block),
        ]
    )
    units = (1.0,) * 3 + (DEGREE,) * 3
    ends = {"from": [each.first for each in poses], "to": [each.second for each in poses]}
    return {"relative_poses": ends | _written(poses, (*AXES, *OPK), values, POSE, units)}
