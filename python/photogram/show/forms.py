"""Documents as JSON and text, and their declared tables as columns of formatted numbers."""

from __future__ import annotations

import gc
import math
import re
import sys
import textwrap
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.io import json
from photogram.io.numbers import degrees_written
from photogram.lazy_dataclasses import replace
from photogram.show import page, quantity
from photogram.show.page import (
    Column,
    Document,
    Drawing,
    Fact,
    Facts,
    Layers,
    Part,
    Remarks,
    Section,
    Table,
    Text,
    without_layers,
)
from photogram.show.quantity import Axis, Quantity, chosen, long
from photogram.words import Words

WIDTH = 100  # characters of a line of prose

TitledLines = tuple[str, list[str]]  # A section of text

PLAIN = str.maketrans("µ–−ᵀ¹", "u--'1") | str.maketrans(
    {"′": "arcmin", "″": "arcsec", "°": "deg", "∞": "inf", "⁻": "^-", "²": "^2"}
)
"""Symbols of pages, replaced by ASCII for terminals."""


def record(document: Document) -> dict[str, object]:
    """Return the members of a JSON document, with its tables by their keys."""
    members = document.all_members()
    for table in document.tables():
        if table.key and any(column.member for column in table.columns):
            *path, name = table.key.split(".")
            place = members
            for member in path:
                place[member] = {**place.get(member, {})}
                place = place[member]
            place[name] = table.record()
    return members


def to_json(document: Document) -> bytes:
    """Return a document as JSON (UTF-8); values that are not numbers are null."""
    enabled = gc.isenabled()
    gc.disable()  # The search for cycles needs more time than the creation of millions of rows.
    try:
        return json.to_json({"program": f"photogram {_photocore.__version__}", **record(document)})
    finally:
        if enabled:
            gc.enable()


def text(document: Document) -> str:
    """Return the text report: verdict, next steps, highlights, sections."""
    head = f"photogram {_photocore.__version__}  {document.what}  {document.title}"
    parts = [head.rstrip().translate(PLAIN)]
    for title, lines in titled_lines(document, width=WIDTH):
        parts.append("\n".join([title, "-" * len(title), *lines]))
    return "\n\n".join(parts) + "\n"


def titled_lines(
    document: Document, keys: Collection[str] | None = None, width: int = sys.maxsize
) -> list[TitledLines]:
    """Return titles and lines: verdict, next steps, key figures, sections.

    With `keys`, only the sections and tables with these keys are returned, without introduction. `width` is
    the maximum number of characters of a line of the verdict.
    """
    sections = [*document.sections, *document.details]
    if keys is not None:
        sections = [replace(each, intro="", parts=_chosen(each, keys)) for each in sections]
    made = formatted(replace(document, sections=sections, details=()))
    sentences = [
        (f"{made.first}, {one.on}".removesuffix(", "), [sentence(one.headline), *one.lines])
        for one in made.judgements
    ]
    titled: list[TitledLines] = [
        (title, [textwrap.fill(str(line), width) for line in lines])
        for title, lines in [*sentences, (made.words("page.advice"), made.advice)]
    ]
    titled.append(("Key figures", fact_lines([*made.head, *made.highlights])))
    for section in made.sections:
        parts = [lines for part in section.parts if (lines := part_lines(part, section.title))]
        intro = textwrap.wrap(section.intro, WIDTH)
        titled.append((section.title, _spaced([intro, *parts]) if parts else []))
    return [
        (title.translate(PLAIN), "\n".join(lines).translate(PLAIN).split("\n"))
        for title, lines in titled
        if lines
    ]


def _chosen(section: Section, keys: Collection[str]) -> Sequence[Part]:
    """Return the parts of a section in a summary: all, or the tables with these keys."""
    if section.key in keys:
        return section.parts
    parts = without_layers(section.parts)
    return [part for part in parts if isinstance(part, quantity.Table) and part.key in keys]


def _spaced(parts: Iterable[list[str]]) -> list[str]:
    """Return lines of parts, with a blank line between two; parts without lines are omitted."""
    paragraphs = ["\n".join(lines) for lines in parts if lines]
    return "\n\n".join(paragraphs).split("\n") if paragraphs else []


def part_lines(part: Part, title: str = "") -> list[str]:
    """Return the lines of a formatted part of a section with a title; empty for plots."""
    match part:
        case Table() as table if any(column.cells for column in table.columns):
            head = [table.title] if table.title not in ("", title) else []
            return [*head, *table_text(table), *textwrap.wrap(table.note, WIDTH)]
        case Facts(caption=caption, facts=facts):
            return [*([caption] if caption not in ("", title) else []), *fact_lines(facts)]
        case Layers(parts=layers):
            return _spaced([part_lines(layer, title) for layer in layers])
        case Text(text=paragraph):
            return textwrap.wrap(paragraph, WIDTH)
        case Remarks(sentences=sentences):
            return [textwrap.fill(each, WIDTH, subsequent_indent="  ") for each in sentences]
    return []


def table_text(table: Table) -> list[str]:
    """Return table lines: names left, numbers right, `*` after marked numbers."""
    lines: list[list[str]] = []
    for column in table.columns:
        texts = [f"{column.head} {column.unit}".rstrip(), *column.cells]
        if not column.text:
            texts[1:] = [f"{text}{'*' * (tone == 'look')}" for text, tone in column.toned]
        texts = [text if text.isascii() else text.translate(PLAIN) for text in texts]
        width = max(map(len, texts))
        lines.append([text.ljust(width) if column.text else text.rjust(width) for text in texts])
    rows = [*zip(*lines, strict=True)]
    if all(column.text for column in table.columns) and max(map(len, rows[0])) > WIDTH // 2:
        # Sentences: rows are paragraphs.
        paragraphs = ("; ".join(filter(None, map(str.rstrip, row))) for row in rows[1:])
        return [textwrap.fill(row, WIDTH, subsequent_indent="  ") for row in paragraphs]
    return ["  ".join(row).rstrip() for row in rows]


def fact_lines(facts: Sequence[Fact]) -> list[str]:
    """Return named values with units and notes in parentheses, one per line."""
    names = [
        fact.name if fact.name[1:2].isupper() else fact.name[:1].lower() + fact.name[1:] for fact in facts
    ]
    width = max([35, *map(len, names)])
    return [
        f"{name:<{width}} {f'{fact.value} {fact.unit}'.rstrip()}{f' ({fact.note})' if fact.note else ''}"
        for name, fact in zip(names, facts, strict=True)
    ]


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
