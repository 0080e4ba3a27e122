"""Documents as JSON and as text in a few lines; `show.html` and `show.pdf` write them as pages."""

from __future__ import annotations

from photogram import _photocore
from photogram.io import json
from photogram.show.cells import written
from photogram.show.lines import fact_lines
from photogram.show.page import Document, Table
from photogram.show.quantity import records

PLAIN = str.maketrans(
    {"µ": "u", "′": "arcmin", "″": "arcsec", "°": "deg", "²": "2", "–": "-", "−": "-", "∞": "inf"}
)
"""Signs of pages as every terminal shows them."""


def record(document: Document) -> dict[str, object]:
    """Return the members of a JSON document: those of the document, and its tables by their keys."""
    tables = [each for each in document.tables() if any(column.member for column in each.columns)]
    return {**document.members, **{each.key: records(each.columns) for each in tables}}


def to_json(document: Document) -> bytes:
    """Return a document as JSON (UTF-8). What is not a number is null."""
    return json.to_json({"program": f"photogram {_photocore.__version__}", **record(document)})


def summary(document: Document, *keys: str) -> list[str]:
    """Return the lines of a summary: verdict, advice, tables with these keys, highlights."""
    lines = [f"verdict: {each.headline}" for each in document.judgements]
    lines += [f"next: {sentence}" for sentence in document.advice]
    for table in document.tables():
        if table.key in keys:
            lines += [each for each in (table.note, *table_text(written(table))) if each]
    lines += [line.translate(PLAIN) for line in fact_lines(document.highlights)]
    return [f"{document.what}: {document.title}", *(f"  {line}" for line in lines)]


def table_text(table: Table) -> list[str]:
    """Return the lines of a table: names to the left, numbers to the right, `*` behind marked numbers."""
    columns = [[f"{column.head} {column.unit}".rstrip().translate(PLAIN)] for column in table.columns]
    for row in table.cells():
        for texts, (column, cell) in zip(columns, row, strict=True):
            texts.append(f"{column.written(cell.value)}{'*' * (cell.tone == 'look')}".translate(PLAIN))
    padded = [
        [f"{text:{'<' if column.text else '>'}{max(map(len, texts))}}" for text in texts]
        for column, texts in zip(table.columns, columns, strict=True)
    ]
    return ["  ".join(row).rstrip() for row in zip(*padded, strict=True)]
