"""Documents as JSON and text; `show.html` and `show.pdf` create pages."""

from __future__ import annotations

import gc
import sys
import textwrap
from collections.abc import Collection, Iterable, Sequence

from photogram import _photocore
from photogram.io import json
from photogram.lazy_dataclasses import replace
from photogram.show import quantity
from photogram.show.cells import formatted, sentence
from photogram.show.page import (
    Document,
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
