"""Tables of positions, velocities, attitudes, rates and relative poses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.covariances import covariance_tables
from photogram.formats.plain.films_written import WrittenFilms
from photogram.formats.plain.groups import (
    SHARED,
    Group,
    group_columns,
    grouped,
    named_groups,
    read_groups,
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
    Transform,
    angles_of,
    columns_of,
    correlations,
    covariances_of,
    indices_of,
    made,
    places_written,
)
from photogram.formats.plain.trajectories import read_smoothness
from photogram.formats.rigging import Rig
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.observations import Attitude, Observation, Position, Rate, Relative, Velocity
from photogram.words import phrase

_Observation = TypeVar("_Observation", bound=Observation)
_Columns = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class _Kind:
    """A type of observation of photos and trajectories."""

    made: type[Position | Velocity | Attitude | Rate]
    table: str
    field: str  # Observed field
    columns: tuple[str, ...]  # Its components
    groups: str  # The table of its groups


_KINDS = (
    _Kind(Position, "gnss", "position", AXES, "gnss_groups"),
    _Kind(Velocity, "velocities", "velocity", VELOCITY, "gnss_groups"),
    _Kind(Attitude, "attitudes", "attitude", ROTATIONS, "attitude_groups"),
    _Kind(Rate, "rates", "rate", RATE, "attitude_groups"),
)


def read_observations(
    tables: Tables,
    transform: Transform,
    subjects: Subjects,
    points: Mapping[str, int],
    rigs: Mapping[str, Rig],
) -> list[Observation]:
    """Read all tables of additional observations."""
    groups = {name: read_groups(tables, name) for name in ("gnss_groups", "attitude_groups")}
    return [
        *(each for kind in _KINDS for each in _read(tables, transform, subjects, kind, groups[kind.groups])),
        *read_smoothness(tables, subjects.trajectories),
        *read_kinds(tables, transform, points, subjects),
        *_relative_poses(tables, subjects.photos),
        *read_bases(tables, rigs),
    ]


def _read(
    tables: Tables, transform: Transform, subjects: Subjects, kind: _Kind, groups: Mapping[str, Group]
) -> Iterator[Observation]:
    table = tables.read(kind.table)
    if table is None:
        return
    of, times = subjects.of(tables, table), table.numbers("time")
    values, covariances = _measured(tables, transform, table, kind)
    for row, (own, group) in enumerate(zip(of, grouped(tables, table, groups, kind.groups), strict=True)):
        if own is None:
            continue
        given = clocked(table, row, own, group.clock)
        given |= {kind.field: values[row], "covariance": covariances[row]}
        given |= {name: getattr(group, name) for name in SHARED[kind.made]}
        if kind.made is Position and given["photo"] is not None:
            time = float(times[row])
            if math.isnan(time):
                time = subjects.times[subjects.photos[given["photo"]]]
            if group.drift is not None and math.isnan(time):
                raise table.error(row, phrase("plain.drift-without-time"))
            given["time"] = 0.0 if math.isnan(time) else time
        yield made(table, row, kind.made, **given)


def _measured(tables: Tables, transform: Transform, table: ColumnTable, kind: _Kind) -> tuple[Floats, Floats]:
    """Return (rows, 3) or (rows, 3, 3) observed values, and (rows, 3, 3) covariances."""
    names, flip = deviation_columns(kind.columns), tables.flip
    if kind.made is Attitude:
        sd = table.vectors(names, read=tables.angle)
        if (common := tables.settings.sd.get(kind.table)) is not None:
            sd = np.where(np.isnan(sd), [tables.angle(repr(each)) for each in common], sd)
        table.check_given(sd, names, kind.table)
        covariances = covariances_of(sd, table, kind.columns, (tables.radians,) * 3)
        return tables.known_matrices(table), flip @ covariances @ flip
    values = table.given(kind.columns)
    sd = tables.deviations(table, kind.table, names)
    table.check_given(sd, names, kind.table)
    covariances = covariances_of(sd, table, kind.columns)
    if kind.made is Position:
        return transform.positions(kind.table, values, covariances, table)
    # Rates refer to axes that are parallel to photo axes.
    return (values @ flip, flip @ covariances @ flip) if kind.made is Rate else (values, covariances)


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
    """Return the tables of additional observations, shared parameters and rigs."""
    return {
        **_group_tables(block),
        **kind_tables(block),
        **_pose_tables(block),
        **rigs.tables(block),
        **films.tables(),
        **covariance_tables(block, cameras, rigs, films.covariances()),
    }


def _all(block: Block, kind: type[_Observation]) -> list[_Observation]:
    return [each for each in block.observations if isinstance(each, kind)]


def _written(
    observations: Sequence[Observation],
    names: Sequence[str],
    values: Floats,
    components: Sequence[str] = (),
    units: Sequence[float] | None = None,
) -> dict[str, Any]:
    """Return columns of observed values, standard deviations, covariances."""
    components = components or names
    precisions = np.array([each.precision for each in observations])
    sd = np.sqrt(np.einsum("nii->ni", precisions)) * (1.0 if units is None else units)
    return {
        **columns_of(names, values),
        **columns_of(deviation_columns(components), sd),
        **correlations(precisions, components, units),
    }


def _group_tables(block: Block) -> _Columns:
    """Return tables of pose observations and their groups."""
    found: _Columns = {}
    for name in ("gnss_groups", "attitude_groups"):
        kinds = [kind for kind in _KINDS if kind.groups == name]
        observed = [_all(block, kind.made) for kind in kinds]
        names, groups = named_groups(
            [each for own in observed for each in own], numbered=name == "gnss_groups"
        )
        start = 0
        for kind, own in zip(kinds, observed, strict=True):
            if own:
                found[kind.table] = subject_columns(own, block) | _observed_columns(kind, own, block)
                if groups:
                    found[kind.table]["group"] = names[start : start + len(own)]
            start += len(own)
        if groups:
            found[name] = group_columns(name, groups, block)
    return found


def _observed_columns(kind: _Kind, own: Sequence[Any], block: Block) -> dict[str, Any]:
    if kind.made is Attitude:
        angles = angles_of(np.array([np.asarray(each.attitude) for each in own]), block)
        return _written(own, OPK, angles, ROTATIONS, (DEGREE,) * 3)
    values = np.array([each.observed[:3] for each in own])
    return _written(own, kind.columns, places_written(block, values) if kind.made is Position else values)


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
