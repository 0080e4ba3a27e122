"""Tables of quantities on a page: a column for each component, or a row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.show import quantity
from photogram.show.angles import degrees_written
from photogram.show.page import Cell, Column, Table, decimals_of, fixed, probability_written, significant
from photogram.show.quantity import Axis, Quantities, Quantity, chosen, long

_SIGNS = {
    "arc seconds": "″",
    "arcsec": "″",
    "arcmin": "′",
    "deg": "°",
    "percent": "%",
    "um": "µm",
    "um/m": "µm/m",
    "um2": "µm²",
}
_MOST_OF_DEGREES = 9

Written = Cell | str | float | None  # Content of a cell


def unit_written(unit: str) -> str:
    """Return a unit with the signs that a page has for it."""
    return _SIGNS.get(unit, unit)


def page_table(caption: str, table: Quantities, note: str = "", by: Floats | None = None) -> Table:
    """Return a table of quantities, a column for each component, or one where each row is of one component.

    Those without a head are left out. `by` are deviations (r, k) that say how many decimals the components
    have: two figures of the median.
    """
    written = [pair for each in table if each.head for pair in _columns(each, by)]
    rows = zip(*(cells for _, cells in written), strict=True)
    return Table(caption, [column for column, _ in written], [*rows], note)


def written(part: Any) -> Any:
    """Return a part of a document; a declared table becomes a table of cells."""
    if isinstance(part, quantity.Table):
        columns = part.columns
        if part.shown is not None:
            columns = (chosen if part.shown.ndim == 1 else long)(columns, part.shown)
        return page_table(part.title, columns, part.note, part.deviations)
    return part


def _columns(each: Quantity, by: Floats | None) -> list[tuple[Column, list[Written]]]:
    if each.of is not None and each.kind == "name":
        mixed = _mixed(each)
        names = [
            f"{axis.name}, {unit_written(axis.small)}" if mixed and axis.small else axis.name
            for axis in each.axes
        ]
        return [(Column(each.head, text=True), [names[k] for k in each.of.tolist()])]
    if not each.axes:
        return [(_column(each, each.head, "", None), _with_marks(_cells(each), each.marked))]
    if each.of is not None:
        decimals = [] if by is None or each.kind == "deviation" else _decimals(each, by)
        known = [count for count in decimals if count is not None]
        unit = "" if _mixed(each) else _unit(each, each.axes[0])
        rows = each.of.tolist()
        counts, axes = [decimals[k] for k in rows] if decimals else [], [each.axes[k] for k in rows]
        cells = _numbers(each, each.outward(), axes, counts, each.marked)
        return [(_column(each, each.head, unit, max(known, default=None)), cells)]
    values = np.reshape(each.outward(), (-1, len(each.axes)))
    marked = None if each.marked is None else np.reshape(each.marked, values.shape)
    found = []
    own = [None] * len(each.axes) if by is None else _decimals(each, by)
    for k, (axis, count) in enumerate(zip(each.axes, own, strict=True)):
        column = _column(each, each.head.format(axis.label or axis.name), _unit(each, axis), count)
        marks = None if marked is None else marked[:, k]
        found.append((column, _numbers(each, values[:, k], [axis] * len(values), [count], marks)))
    return found


def _mixed(each: Quantity) -> bool:
    return len({axis.small for axis in each.axes}) > 1


def _column(each: Quantity, head: str, unit: str, decimals: int | None) -> Column:
    count = each.decimals if decimals is None else decimals
    return Column(head, unit, decimals=count, figures=each.figures, text=each.kind == "name")


def _unit(each: Quantity, axis: Axis) -> str:
    if each.kind == "value" and axis.angle == "dms":
        return "° ′ ″"
    return unit_written(each.unit(axis))


def _decimals(each: Quantity, by: Floats) -> list[int | None]:
    """Return the decimals of components: two figures of the median deviation, of degrees four more.

    None where nothing tells: in a column of several components whose deviation is not known.
    """
    if each.kind == "number" or each.decimals is not None:
        return [each.decimals] * len(each.axes)
    found: list[int | None] = []
    alone = each.of is not None and _mixed(each)
    for axis, column in zip(each.axes, np.reshape(by, (-1, len(each.axes))).T, strict=True):
        count = decimals_of(column * axis.factor)
        if alone and not (column > 0).any():
            found.append(None)
            continue
        if each.kind == "value" and axis.angle:
            count = min(count + (4 if axis.angle == "deg" else 0), _MOST_OF_DEGREES)
        elif each.kind == "difference":
            count += 1
        found.append(count)
    return found


def _cells(each: Quantity) -> list[Written]:
    """Write names, and numbers that have no axis."""
    if each.kind == "probability":
        values = np.asarray(each.values, dtype=float).tolist()
        return [Cell(probability_written(p), sorts=p) if math.isfinite(p) else None for p in values]
    if each.kind != "name":
        values = np.asarray(each.values)
        return [*(values if each.seen is None else np.where(each.seen, values, np.nan)).tolist()]
    plain = np.asarray(each.values).tolist()
    if each.link is None:
        return [*map(str, plain)]
    ids = [f"{each.link.kind}-{row}" for row in each.link.rows.tolist()]
    if each.link.here:
        return [Cell(str(name), id=own) for name, own in zip(plain, ids, strict=True)]
    return [Cell(str(name), goes_to=own) for name, own in zip(plain, ids, strict=True)]


def _numbers(
    each: Quantity,
    values: Floats,
    axes: Sequence[Axis],
    decimals: Sequence[int | None],
    marked: Bools | None = None,
) -> list[Written]:
    """Write numbers as people see them, with the axis and the decimals of each."""
    words = each.words or {}
    counts = cycle(decimals or [None])
    # What shares a column and is of several components has decimals of its own.
    own = each.kind == "difference" or (each.kind == "value" and each.of is not None and _mixed(each))
    found = [
        words[value] if value in words else _number(each, value, axis, count, own=own)
        for value, axis, count in zip(values.tolist(), axes, counts, strict=False)
    ]
    return _with_marks(found, marked)


def _number(each: Quantity, value: float, axis: Axis, decimals: int | None, *, own: bool) -> Written:
    if not math.isfinite(value):
        return value
    if each.kind == "value" and axis.angle == "dms":
        return Cell(degrees_written(value, decimals or 0), sorts=math.degrees(value))
    if not own:
        return value
    return Cell(significant(value, each.figures) if decimals is None else fixed(value, decimals), sorts=value)


def _with_marks(cells: list[Written], marked: Bools | None) -> list[Written]:
    if marked is None:
        return cells
    whole = [cell if isinstance(cell, Cell) else Cell(cell) for cell in cells]
    return [replace(cell, tone="look") if mark else cell for cell, mark in zip(whole, marked, strict=True)]
