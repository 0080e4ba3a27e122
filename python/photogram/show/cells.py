"""Conversion of declared tables to columns of formatted numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.angles import degrees_written
from photogram.show import page, quantity
from photogram.show.page import Column, Document, Drawing, Facts, Part, Remarks, Section, Text
from photogram.show.quantity import Axis, Quantity, chosen, long
from photogram.words import Words

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

Draw = Callable[[Drawing], Drawing | None]  # Draws a plot; returns None without data


def unit_written(unit: str) -> str:
    """Return a unit with the symbols of pages."""
    return _SIGNS.get(unit, unit)


def formatted(document: Document, draw: Draw = lambda drawing: drawing) -> Document:
    """Return the visible parts of a document with full sentences, formatted tables and drawn plots."""

    def visible(sections: Sequence[Section]) -> list[Section]:
        whole = [replace(each, parts=_written(each.parts, document.words, draw)) for each in sections]
        return [section for section in whole if section.parts]

    return replace(
        document,
        title=re.sub(r"\s*\.{4,}\s*", " – ", document.title),  # Leaders of the title cards of GIANT
        judgements=[replace(one, lines=[*map(sentence, one.lines)]) for one in document.judgements],
        advice=[*map(sentence, document.advice)],
        sections=visible(document.sections),
        details=visible(document.details),
    )


def sentence(text: object) -> str:
    """Return a sentence with a full stop, and a capital letter unless it begins with the name of a file."""
    line = str(text).removesuffix(".")
    return f"{line if '.' in line.partition(' ')[0][:-1] else line[:1].upper() + line[1:]}."


def _written(parts: Sequence[Part], words: Words, draw: Draw) -> list[Any]:
    found: list[Any] = []
    for part in parts:
        match part:
            case page.Layers():
                layers = _written(part.parts, words, draw)
                found += layers if len(layers) < 2 else [replace(part, parts=layers)]
            case Drawing():
                found += [drawing] if (drawing := draw(part)) else []
            case quantity.Table(visible=False) | Facts(facts=[]) | Remarks(sentences=[]) | Text(text=""):
                continue
            case quantity.Table():
                found.append(written(part, words.numeral if words.language != "en" else str))
            case _:
                found.append(part)
    return found


def written(table: quantity.Table, numeral: Callable[[str], str] = str) -> page.Table:
    """Return a declared table with formatted cells.

    Columns without a head or content are omitted. The standard deviations of a table define the decimals of
    its components: two digits of the median. `numeral` converts numbers to the format of a language.
    """
    columns = table.columns
    if table.shown is not None:
        columns = (chosen if table.shown.ndim == 1 else long)(columns, table.shown)
    found = [column for each in columns if each.head for column in _columns(each, table.deviations, numeral)]
    return page.Table(table.title, [each for each in found if {*each.cells} - {"", "–"}], table.note)


def _columns(each: Quantity, by: Floats | None, numeral: Callable[[str], str]) -> Iterator[Column]:
    axes, of = each.axes or (Axis(""),), each.of
    count = len(axes) if of is None else 1
    marked = [()] * count if each.marked is None else np.reshape(each.marked, (-1, count)).T.tolist()
    mixed = of is not None and len({axis.small for axis in axes}) > 1  # Each component has its own unit
    if each.kind == "name":
        names = [*map(str, np.asarray(each.values).tolist())]
        if mixed and of is not None:  # Components with their units
            units = [f", {unit_written(axis.small)}" if axis.small else "" for axis in axes]
            names = [name + units[k] for name, k in zip(names, of.tolist(), strict=True)]
        yield Column(each.head, names, text=True, marked=marked[0], link=each.link)
        return
    decimals = _decimals(each, by, mixed)
    for k, column in enumerate(np.reshape(each.outward(), (-1, count)).T):
        axis, rows = axes[k], np.full(len(column), k) if of is None else of
        cells = [
            numeral(_written_number(each, value, axes[row], decimals[row]))
            for value, row in zip(column.tolist(), rows.tolist(), strict=True)
        ]
        head = each.head.format(axis.label or axis.name) if of is None else each.head
        unit = "° ′ ″" if each.kind == "value" and axis.angle == "dms" else unit_written(each.unit(axis))
        yield Column(head, cells, "" if mixed else unit, marked=marked[k])


def _decimals(each: Quantity, by: Floats | None, mixed: bool) -> list[int | None]:
    """Return decimals of components: two digits of the median sd, degrees more.

    None if unknown: in a column of several components without standard deviation.
    """
    count, of_rows = len(each.axes), each.of is not None
    measured = each.kind in ("value", "difference") or (each.kind == "deviation" and not of_rows)
    if each.decimals is not None or by is None or not measured or not count:
        return [each.decimals] * max(count, 1)
    found: list[int | None] = []
    for axis, column in zip(each.axes, np.reshape(by, (-1, count)).T, strict=True):
        own = page.decimals_of(column * axis.factor) + (each.kind == "difference")
        if each.kind == "value" and axis.angle:
            own = min(own + (4 if axis.angle == "deg" else 0), _MOST_OF_DEGREES)
        found.append(None if of_rows and mixed and not (column > 0).any() else own)
    if of_rows and each.kind == "value" and not mixed:
        return [max(own for own in found if own is not None)] * count
    return found


def _written_number(each: Quantity, value: Any, axis: Axis, decimals: int | None) -> str:
    if each.words and value in each.words:
        return each.words[value]
    if each.kind == "probability":
        return page.probability_written(value) if math.isfinite(value) else ""
    if each.kind == "value" and axis.angle == "dms" and math.isfinite(value):
        return degrees_written(value, decimals or 0)
    return page.number_text(value, decimals, each.figures)
