"""Tables of point observations with shared parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.schema import AXES, DIFFERENCE, TABLES, deviation_columns
from photogram.formats.plain.subjects import Subjects, clocked, scalar_columns, scalars, subject_columns
from photogram.formats.plain.tables import (
    DEGREE,
    Tables,
    Transform,
    columns_of,
    correlations,
    covariances_of,
    different,
    indices_of,
    made,
    places_written,
    vectors_of,
)
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.block import Block
from photogram.network.observations import (
    Difference,
    Distance,
    EqualHeight,
    Observation,
    OnLevel,
    OnLine,
    OnPlane,
    OnPlumbLine,
    Range,
)
from photogram.network.trajectories import Clock
from photogram.network.unknowns import Instrument, Level, Line, Plane, PlumbLine, Unknown
from photogram.words import phrase

_THROUGH = "through"  # The field that contains a position, in the frame of the project


@dataclass(frozen=True)
class _Common:
    """Shared parameters of observations; without a row in their table they are free."""

    made: type[Unknown]  # Class of the parameters; its fields define the defaults of empty cells
    column: str  # Column of their name in their table (named after it), and in tables of observations
    values: Mapping[str, tuple[str, ...]]  # Columns of each field: all or none in a row
    sd: tuple[str, ...]  # Columns of standard deviations; empty means free

    @property
    def table(self) -> str:
        return f"{self.column}s"


@dataclass(frozen=True)
class _Kind:
    """A type of observation."""

    made: type[Observation]  # Its class, and the table
    table: str
    points: Mapping[str, str]  # Columns of point names by field
    # Columns of each observed field; default 0 if optional
    values: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    # Components with standard deviations `sd_..` and covariances; empty: a single `sd`
    sd: tuple[str, ...] = ()
    unknown: str = ""  # The field of shared parameters, and their type
    common: _Common | None = None
    # Whether it belongs to a photo, or to a trajectory at a time, and has a lever arm
    of_photos: bool = False

    @property
    def sd_columns(self) -> tuple[str, ...]:
        return deviation_columns(self.sd) or ("sd",)


_TILTS = ("sd_rotation_x", "sd_rotation_y")
_ENDS, _POINT = {"first": "from", "second": "to"}, {"point": "point"}
_LEVER = ("lever_x", "lever_y", "lever_z")
_INSTRUMENTS = _Common(
    Instrument, "instrument", {"scale": ("scale",), "constant": ("constant",)}, ("sd_scale", "sd_constant")
)
_LEVELS = _Common(Level, "level", {"height": ("z",)}, ("sd",))
_PLANES = _Common(Plane, "plane", {_THROUGH: AXES, "normal": ("nx", "ny", "nz")}, ("sd_distance", *_TILTS))
_LINES = _Common(Line, "line", {_THROUGH: AXES, "direction": DIFFERENCE}, ("sd_x", "sd_y", *_TILTS))
_PLUMB_LINES = _Common(PlumbLine, "plumb_line", {_THROUGH: AXES}, ("sd_x", "sd_y"))
_KINDS = (
    _Kind(Distance, "distances", _ENDS, {"length": ("distance",)}, unknown="instrument", common=_INSTRUMENTS),
    _Kind(
        Range,
        "ranges",
        _POINT,
        {"length": ("range",)},
        unknown="instrument",
        common=_INSTRUMENTS,
        of_photos=True,
    ),
    _Kind(EqualHeight, "height_differences", _ENDS, {"difference": ("dz",)}),
    _Kind(Difference, "coordinate_differences", _ENDS, {"vector": DIFFERENCE}, DIFFERENCE),
    _Kind(OnLevel, "level_points", _POINT, {"difference": ("dz",)}, unknown="level", common=_LEVELS),
    _Kind(OnPlane, "plane_points", _POINT, {"distance": ("distance",)}, unknown="plane", common=_PLANES),
    _Kind(OnLine, "line_points", _POINT, sd=("x", "y"), unknown="line", common=_LINES),
    _Kind(OnPlumbLine, "plumb_line_points", _POINT, sd=("x", "y"), unknown="line", common=_PLUMB_LINES),
)


def read_kinds(
    tables: Tables, transform: Transform, points: Mapping[str, int], subjects: Subjects
) -> list[Observation]:
    """Read the tables of all types."""
    # Tables of shared parameters are read once, for all types.
    commons = {kind.common.table: kind.common for kind in _KINDS if kind.common is not None}
    known = {name: _commons(tables, transform, each) for name, each in commons.items()}
    found: list[Observation] = []
    for kind in _KINDS:
        table = tables.read(kind.table)
        if table is None:
            continue
        given = _given(tables, table, points, kind)
        if kind.common is not None:
            given[kind.unknown] = _named(table, kind.common, known[kind.common.table])
        of = _of_photos(tables, table, kind, subjects, given) if kind.of_photos else [{}] * table.count
        found += [
            made(table, row, kind.made, **own, **{name: each[row] for name, each in given.items()})
            for row, own in enumerate(of)
            if own is not None
        ]
    return found


def _of_photos(
    tables: Tables, table: ColumnTable, kind: _Kind, subjects: Subjects, given: dict[str, list[Any]]
) -> list[dict[str, Any] | None]:
    """Return subject and clock of each row, None if it is skipped; adds lever arms."""
    given["lever_arm"] = list(tables.vectors(table, _LEVER, 0.0))
    own_clocks = scalars(tables, table, Clock, [kind.table] * table.count)
    return [
        None if own is None else clocked(table, row, own, own_clocks[row])
        for row, own in enumerate(subjects.of(tables, table))
    ]


def _given(
    tables: Tables, table: ColumnTable, points: Mapping[str, int], kind: _Kind
) -> dict[str, list[Any]]:
    """Return the fields of all rows except shared parameters."""
    required, names = TABLES[kind.table].required, list(points)
    if kind.common is not None and kind.common.column in required:
        table.names(kind.common.column)
    given: dict[str, list[Any]] = {
        name: [names[row] for row in indices_of(table, column, points, "point").tolist()]
        for name, column in kind.points.items()
    }
    missing: Any = False
    for name, columns in kind.values.items():
        needed = required[-1] in columns
        values = table.vectors(columns, math.nan if needed else 0.0)
        if kind.made.MISSING:
            missing = np.isnan(values)
        else:
            table.check_given(values, columns)
        given[name] = list(values) if len(columns) > 1 else values[:, 0].tolist()
    sd = np.where(missing, 1.0, tables.deviations(table, kind.table, kind.sd_columns))
    table.check_given(sd, kind.sd_columns, kind.table)
    if kind.sd:
        given["covariance"] = list(covariances_of(sd, table, kind.sd))
    else:
        given["sd"] = sd[:, 0].tolist()
    return given


def _named(table: ColumnTable, common: _Common, known: dict[str, Unknown]) -> list[Unknown | None]:
    """Return the shared parameters of each row; names without a table row are added."""
    found: list[Unknown | None] = []
    for row, name in enumerate(table.texts(common.column)):
        if name and name not in known:
            known[name] = made(table, row, common.made, name)
        found.append(known[name] if name else None)
    return found


def _commons(tables: Tables, transform: Transform, common: _Common) -> dict[str, Unknown]:
    table = tables.rows(common.table)
    table.names(common.column)
    given: dict[str, Floats] = {}
    for name, columns in common.values.items():
        given[name] = vectors_of(table, columns)
        if name == _THROUGH:
            given[name], _ = transform.positions(common.table, given[name], None, table)
    given["sd"] = np.column_stack(
        [
            table.numbers(each, math.inf, infinite=True, read=tables.angle if each in _TILTS else None)
            for each in common.sd
        ]
    )
    found: dict[str, Unknown] = {}
    for row, title in enumerate(table.texts(common.column)):
        if title in found:
            raise table.error(row, phrase("error.repeated", kind=common.made.KIND, name=title))
        own: dict[str, Any] = {
            name: values[row] if values.shape[1] > 1 else float(values[row, 0])
            for name, values in given.items()
            if not np.isnan(values[row]).all()
        }
        found[title] = made(table, row, common.made, title, **own)
    return found


def kind_tables(block: Block) -> dict[str, dict[str, Any]]:
    """Return the tables of all types of observations of a block."""
    found: dict[str, dict[str, Any]] = {}
    for kind in _KINDS:
        own = [each for each in block.observations if isinstance(each, kind.made)]
        if not own:
            continue
        first, last = _photo_columns(own, block) if kind.of_photos else ({}, dict[str, Any]())
        common: dict[str, dict[str, Any]] = {}
        if kind.common is not None:
            commons = [getattr(each, kind.unknown) for each in own]
            if different(commons):
                common = {kind.common.table: _common_columns(block, kind.common)}
                needed = kind.common.column in TABLES[kind.table].required
                (first if needed else last)[kind.common.column] = [
                    each.name if each else "" for each in commons
                ]
        first |= {column: [getattr(each, name) for each in own] for name, column in kind.points.items()}
        for name, names in kind.values.items():
            values = np.array([getattr(each, name) for each in own], dtype=float)
            first |= columns_of(names, values.reshape(len(own), -1))
        table = {kind.table: first | _deviations(own, kind) | last}
        found |= table | common if last else common | table
    return found


def _photo_columns(own: list[Any], block: Block) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the columns of subjects, and of lever arms and clocks."""
    last = scalar_columns(Clock, [None if each.moment is None else each.clock for each in own])
    levers = np.array([each.observed[1:4] for each in own])
    if levers.any():
        last = columns_of(_LEVER, levers) | last
    return subject_columns(own, block), last


def _deviations(own: list[Observation], kind: _Kind) -> dict[str, Any]:
    covariances = np.array([each.precision for each in own])
    if not kind.sd:
        return {"sd": np.array([each.sd for each in own], dtype=float)}  # type: ignore[attr-defined]
    if kind.made.MISSING:
        seen = ~np.isnan([each.observed for each in own])
        # Matrix elements of unobserved components are ignored.
        covariances = np.where(seen[:, :, np.newaxis] & seen[:, np.newaxis, :], covariances, np.nan)
    sd = np.sqrt(np.einsum("nii->ni", covariances))
    return columns_of(kind.sd_columns, sd) | correlations(covariances, kind.sd)


def _common_columns(block: Block, common: _Common) -> dict[str, Any]:
    """Return a table of shared parameters of observations of all types."""
    kinds = {kind.made: kind.unknown for kind in _KINDS if kind.common is common}
    named = (each for kind in kinds for each in block.observations if isinstance(each, kind))
    there = different([getattr(each, kinds[type(each)]) for each in named])
    columns: dict[str, Any] = {common.column: [each.name for each in there]}
    for name, names in common.values.items():
        nothing = (math.nan,) * len(names)
        if name == _THROUGH:
            values = [nothing if each.is_open else each.position for each in there]
        else:
            # As it was given: other axes follow from it
            given = (getattr(each, name) for each in there)
            values = [nothing if own is None else np.ravel(own) for own in given]
        array = np.array(values, dtype=float)
        columns |= columns_of(names, places_written(block, array) if name == _THROUGH else array)
    units = np.array([DEGREE if each in _TILTS else 1.0 for each in common.sd])
    sd = np.array([each.deviations for each in there]).reshape(len(there), -1) * units
    return columns | columns_of(common.sd, sd)
