"""Shared unknowns in the rows of tables: instruments, surfaces, lever arms, boresights, clocks, sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.schema import ANGULAR, OPK, TURNS, Column, Parameter
from photogram.formats.plain.tables import (
    Tables,
    Transform,
    angles_of,
    called,
    check_complete,
    columns_of,
    places_written,
    word_of,
)
from photogram.io.column_table import ColumnTable
from photogram.io.numbers import degrees_typed
from photogram.network import trajectories, unknowns
from photogram.network.block import Block
from photogram.network.unknowns import Unknown
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
        tables.check_known(table, values)
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
    """Return a class of unknowns by name."""
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
            found.append(tables.shared.one(table, row, unknown.name, make, name, sd=sd[row], **fields))
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
