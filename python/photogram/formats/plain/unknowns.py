"""Shared unknowns in the rows of tables: instruments, surfaces, lever arms, boresights, clocks, sensors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.arrays import matrix_fault
from photogram.arguments.types import Floats
from photogram.formats.plain.schema import ANGULAR, OPK, TURNS, Column, Parameter
from photogram.formats.plain.tables import (
    DEGREE,
    Tables,
    Transform,
    angles_of,
    called,
    check_complete,
    check_rows,
    columns_of,
    columns_of_records,
    made,
    places_written,
    signs_in_files,
    word_of,
)
from photogram.io.column_table import ColumnTable
from photogram.io.numbers import degrees_typed
from photogram.lazy_dataclasses import dataclass
from photogram.messages import unknown_name
from photogram.network import trajectories, unknowns
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.observations import Observation, Prior
from photogram.network.passages import Knot
from photogram.network.trajectories import GyroBias, RotationCoefficient
from photogram.network.unknowns import Boresight, Drift, LeverArm, Sensor, Shift, Unknown
from photogram.words import phrase


def read_values(tables: Tables, table: ColumnTable, column: Column) -> Floats:
    """Return (rows, k) numbers or (rows, 3, 3) rotations of a quantity in internal axes; NaN without."""
    if column.kind in TURNS:
        matrices = tables.matrices(table)
        return matrices if column.kind == "attitude" else tables.flip @ matrices
    values = table.vectors(column.names, column.number)
    return values @ tables.flip if column.kind == "body" else values


def read_observed(tables: Tables, table: ColumnTable, column: Column, *, whole: bool) -> Any:
    """Return the values of a quantity as :func:`read_values`, numbers as a list; reject NaN if `whole`."""
    values = read_values(tables, table, column)
    if column.kind in TURNS:
        check_rows(table, np.isnan(values).any(axis=(1, 2)), phrase("plain.no-angles"))
    elif whole:
        table.check_given(values, column.names)
    return values if values[0:1].size != len(values[0:1]) else values[:, 0].tolist()


def written_values(block: Block, column: Column, values: Floats) -> dict[str, Any]:
    """Return the columns of (rows, k) numbers or (rows, 3, 3) rotations of a quantity."""
    if column.kind in TURNS:
        return columns_of(OPK, angles_of(values, block))
    values = values.reshape(len(values), -1)
    return columns_of(column.names, places_written(block, values) if column.kind == "place" else values)


def unknown_class(name: str) -> type[Unknown]:
    found: type[Unknown] = getattr(unknowns, name, None) or getattr(trajectories, name)
    return found


def read_unknowns(
    tables: Tables,
    table: ColumnTable,
    unknown: Parameter,
    titles: Sequence[str],
    transform: Transform | None = None,
) -> list[Any]:
    """Return the unknown of each row, or its fixed value; None without.

    Titles are the names of unknowns with the cell `true`, or without a cell.
    """
    make, rule, values = unknown_class(unknown.class_name), unknown.rule, dict[str, Floats]()
    if rule == "any" and not any(name in table for column in unknown.columns for name in column.names):
        return [None] * table.count
    for column in unknown.values:
        own = read_values(tables, table, column)
        if column.kind not in TURNS and math.isnan(column.number):
            check_complete(table, own, phrase("plain.all-or-none", columns=list(column.names)))
        if column.kind == "mounting":
            own = own.transpose(0, 2, 1)
        elif column.kind == "place" and transform is not None:
            own, _ = transform.positions(column.table, own, None, table)
        values[column.field] = own
    default = next(column.number for column in unknown.columns if column.kind == "sd")
    sd = np.column_stack([tables.sd(table, name, default) for name in unknown.sd])
    cells = table.texts(unknown.name, unknown.columns[0].default if rule == "name" else "")
    usual = [column.number for column in unknown.values]
    found: list[Any] = []
    for row, (cell, title) in enumerate(zip(cells, titles, strict=True)):
        fields: dict[str, Any] = {
            name: float(own[row, 0]) if own[row].size == 1 else own[row]
            for name, own in values.items()
            if not np.isnan(own[row]).any()
        }
        name = called(cell, title) if rule == "name" else cell or title
        if rule == "sd" and not sd[row].any():
            found.append(tuple(fields["value"].tolist()))
        elif not name or (rule == "any" and not cell and not sd[row].any() and [*fields.values()] == usual):
            found.append(None)
        else:
            found.append(tables.unknown(table, row, unknown.name, make, name, sd=sd[row], **fields))
    return found


def unknown_columns(
    block: Block, unknown: Parameter, own: Sequence[Any], titles: Sequence[str]
) -> dict[str, Any]:
    """Return the columns of unknowns or their fixed values; nothing if empty cells are equivalent."""
    default = unknown.columns[0].default
    if all(each is None for each in own) and default not in ("", "true"):
        return {}
    if unknown.rule == "name":
        cells = [
            "true" if each is not None and getattr(each, "name", title) == title else word_of(each)
            for each, title in zip(own, titles, strict=True)
        ]
    else:
        cells = [each.name if isinstance(each, Unknown) else "" for each in own]
    found = {} if set(cells) == {default} else {unknown.name: cells}
    return found | value_columns(block, unknown, own)


def value_columns(block: Block, unknown: Parameter, own: Sequence[Any]) -> dict[str, Any]:
    """Return the columns of values and standard deviations of unknowns."""
    found: dict[str, Any] = {}
    for column in unknown.values:
        turns = column.kind in TURNS
        values = np.full((len(own), *((3, 3) if turns else (len(column.names),))), math.nan)
        for row, each in enumerate(own):
            value = getattr(each, column.field) if isinstance(each, Unknown) else each  # A fixed value
            if value is None and turns and isinstance(each, Unknown) and not each.is_open:
                value = np.eye(3)
            if value is not None:
                values[row] = value
        if column.kind == "mounting":
            values = values.transpose(0, 2, 1)
        if turns or not (np.isnan(values).all() and math.isnan(column.number)):
            found |= written_values(block, column, values)
    sd = np.full((len(own), len(unknown.sd)), math.nan)
    for row, each in enumerate(own):
        if each is not None:
            sd[row] = each.deviations if isinstance(each, Unknown) else 0.0
    for name, deviations in zip(unknown.sd, sd.T, strict=True):
        found[name] = degrees_typed(deviations) if name.removeprefix("sd_") in ANGULAR else deviations
    return found


CAMERA = "camera"
OF_FILMS = ("scanner", "fiducials", "film")
"""Types of objects whose readers request covariances by name."""
_WITH_PHOTOS = {each.KIND for each in (LeverArm, Boresight, Sensor, GyroBias, RotationCoefficient)}
"""Unknowns along, or about, the axes of photos or of bodies."""


@dataclass(frozen=True)
class Covariances:
    """The table: rows, pairs of components and numbers by type and name of the object."""

    tables: Tables
    table: ColumnTable
    parts: Mapping[tuple[str, str], list[tuple[int, str, str, float]]]

    def names(self, kind: str, name: str) -> set[str]:
        """Return the component names in the matrix of an object."""
        return {word for _, *pair, _ in self.parts.get((kind, name), ()) for word in pair}

    def _matrix(self, kind: str, name: str, units: Mapping[str, float], what: str) -> Floats:
        """Return the matrix over the components that have units; missing covariances are 0."""
        places, found = {word: k for k, word in enumerate(units)}, np.zeros((len(units),) * 2)
        for row, first, second, value in self.parts[kind, name]:
            for word in (first, second):
                if word not in units:
                    raise self.table.error(row, unknown_name(what, word, units))
            i, j = places[first], places[second]
            found[i, j] = found[j, i] = units[first] * units[second] * value
        return found

    def cameras(self, cameras: Sequence[Camera]) -> list[Camera]:
        known = {each.name for each in cameras}
        for (kind, name), own in self.parts.items():
            if kind == CAMERA and name not in known:
                raise self.table.unknown_error(own[0][0], "name", "camera", name, known)
        return [self._camera(each) if (CAMERA, each.name) in self.parts else each for each in cameras]

    def _camera(self, camera: Camera) -> Camera:
        scale = 1e-3 if self.tables.settings.image == "um" else 1.0
        units = {
            name.lower(): sign * scale ** camera.powers[name]
            for name, sign in zip(camera.names, signs_in_files(camera.names).tolist(), strict=True)
        }
        whole = self._matrix(CAMERA, camera.name, units, f"parameter of the camera {camera.name}")
        words = self.names(CAMERA, camera.name)
        there = [row for row, name in enumerate(camera.names) if name.lower() in words]
        names = [camera.names[row] for row in there]
        # Parameters without standard deviation are fixed, except those in the matrix.
        deviations = zip(camera.names, camera.deviations.tolist(), strict=True)
        sd = {name: own for name, own in deviations if own or name not in names}
        given = names, whole[np.ix_(there, there)]
        first = self.parts[CAMERA, camera.name][0][0]
        return made(self.table, first, lambda: camera.replace(sd=sd, covariance=given))

    def over(
        self, kind: str, name: str, components: Sequence[str], *, singular: bool = False
    ) -> Floats | None:
        """Return the matrix of films, scanners or marks; None if missing.

        If `singular` is True, the matrix may be singular.
        """
        own = self.parts.get((kind, name))
        if own is None:
            return None
        found = self._matrix(kind, name, dict.fromkeys(components, 1.0), f"component of {kind} {name}")
        variances = {first for _, first, second, _ in own if first == second}
        if missing := [word for word in components if word not in variances]:
            message = phrase("plain.no-covariance", kind=kind, name=name, component=missing[0])
            raise self.table.error(own[0][0], message)
        if fault := matrix_fault(found, singular=singular):
            raise self.table.error(own[0][0], fault)
        return found

    def priors(self, unknowns: Iterable[Unknown]) -> list[Observation]:
        """Return the joint priors of unknowns as observations."""
        known = {(each.KIND, each.name): each for each in unknowns}
        found: list[Observation] = []
        for (kind, name), own in self.parts.items():
            if kind in (CAMERA, *OF_FILMS):
                continue
            if (kind, name) not in known:
                raise self.table.error(own[0][0], unknown_name(kind, name, [title for _, title in known]))
            units = _units(known[kind, name], self.tables.radians, np.diag(self.tables.flip).tolist())
            covariance = self._matrix(kind, name, units, f"component of {kind}")
            found.append(made(self.table, own[0][0], Prior, known[kind, name], covariance=covariance))
        return found


def read_covariances(tables: Tables) -> Covariances:
    """Read the table of covariances; empty if it does not exist."""
    table, parts = tables.rows("covariances"), dict[tuple[str, str], list[tuple[int, str, str, float]]]()
    seen = set[tuple[str, ...]]()
    for row, cells in enumerate(tables.records("covariances")):
        kind, name = cells["kind"].lower().replace("_", " "), cells["name"]
        # Parameters of cameras have the names of their columns, components of others are words.
        first, second = (
            cells[word].lower() if kind == CAMERA else cells[word].lower().replace("_", " ")
            for word in ("first", "second")
        )
        if (kind, name, first, second) in seen:
            raise table.error(row, phrase("plain.covariance-twice", first=first, second=second))
        seen |= {(kind, name, first, second), (kind, name, second, first)}
        parts.setdefault((kind, name), []).append((row, first, second, cells["covariance"]))
    return Covariances(tables, table, parts)


def covariance_tables(
    block: Block,
    cameras: Sequence[Camera],
    title_of: Callable[[Sensor], str],
    more: Iterable[tuple[str, str, Sequence[str], Floats]],
) -> dict[str, dict[str, Any]]:
    """Return the table of joint priors of cameras, of unknowns, and of `more`.

    `title_of` returns the name of a sensor in the tables; `more` contains type, name, components and
    covariance matrix.
    """
    joined: list[tuple[str, str, Sequence[str], Floats]] = []
    for each in cameras:
        if each.covariance is not None:
            names, matrix = each.covariance
            signs = signs_in_files(names)
            joined.append((CAMERA, each.name, names, np.asarray(matrix) * signs * signs[:, np.newaxis]))
    for prior in block.observations.of_type(Prior):
        unknown = prior.unknown
        if isinstance(unknown, Knot):
            continue  # In the table of knots
        units = np.array(list(_units(unknown, DEGREE).values()))
        title = title_of(unknown) if isinstance(unknown, Sensor) else unknown.name
        title = word_of(unknown) if isinstance(unknown, Shift | Drift | GyroBias) else title
        matrix = prior.precision * units * units[:, np.newaxis]
        joined.append((unknown.KIND, title, unknown.components, matrix))
    rows = (
        {"kind": kind, "name": name, "first": components[i], "second": components[j]}
        | {"covariance": float(matrix[i, j])}
        for kind, name, components, matrix in (*joined, *more)
        for i in range(len(components))
        for j in range(i + 1)
        if i == j or matrix[i, j]
    )
    return {"covariances": columns_of_records(rows)}


def _units(unknown: Unknown, angle: float, signs: Sequence[float] = (1.0,) * 3) -> dict[str, float]:
    """Return unit and sign factors of the components of an unknown.

    Signs are the signs of photo and body axes in tables.
    """
    pairs = zip(unknown.components, unknown.units(""), strict=True)
    axes = dict(zip("xyz", signs, strict=True)) if unknown.KIND in _WITH_PHOTOS else {}
    return {name: (angle if unit == "rad" else 1.0) * axes.get(name[-1], 1.0) for name, unit in pairs}
