"""The page of a check: what was found, then what was looked at."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import groupby
from typing import Any

from photogram.diagnosis.findings import Diagnosis, Figure, Finding, Listing, Names, Section
from photogram.results.page.network import drawings
from photogram.show.judgement import judged, verdict_table
from photogram.show.methods import page_of
from photogram.show.page import Cell, Column, Document, Fact, Facts, Part, Remarks, Row, Table, Text
from photogram.show.page import Section as Chapter

_TESTS = (
    "Those of the adjustment, without what was found wrong: what the verdict rests on beside the findings."
)
MARKS = {"grave": "grave", "look": "to look at"}
NAMED = 6
"""Photos and points that a row names."""


@page_of.register(Diagnosis)
def check_page(found: Diagnosis) -> Document:
    """Return the report of a check for the browser."""
    grave, look = len(found.grave), len(found.findings) - len(found.grave)
    verdict = found.verdict
    pictures = drawings(found.result) if found.result is not None else {}
    chapters = [
        Chapter("findings", "Findings", [_table(found)] if found.findings else [], _INTRO),
        Chapter("network", "Plan of the network", [pictures["network"]] if pictures else []),
        *(_chapter(number, section) for number, section in enumerate(found.sections)),
        Chapter("tests", "Tests", [verdict_table(verdict)] if verdict.tests else [], _TESTS),
    ]
    return Document(
        what="Check of a network before its adjustment",
        title=found.title,
        judgements=[replace(judged(verdict), lines=())],  # the table of findings has them
        advice=verdict.next,
        highlights=[
            Fact("Grave", f"{grave}", tone="bad" if grave else ""),
            Fact("To look at", f"{look}", tone="look" if look else ""),
        ],
        sections=chapters,
    )


_INTRO = (
    "Grave findings make results wrong or impossible; the others deserve a look. A mistake that"
    " explains others is put"
    " right before the next step looks, so that each is named once. Nothing was changed in the files."
)


def _table(found: Diagnosis) -> Table:
    rows: list[Row] = []
    ordered = sorted(
        ((section.title, each) for section in found.sections for each in section.findings),
        key=lambda pair: pair[1].level != "grave",
    )
    for title, each in ordered:
        tone = "bad" if each.level == "grave" else "look"
        rows.append([Cell(MARKS[each.level], tone=tone), each.text, _named(each), title])  # type: ignore[arg-type]
    columns = (
        Column("Level", text=True),
        Column("Finding", text=True),
        Column("Photos and points", text=True),
        Column("Found by", text=True),
    )
    return Table("Findings", columns, rows)


def _named(each: Finding) -> str:
    names = [*each.photos, *each.points]
    return ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")


def _chapter(number: int, section: Section) -> Chapter:
    parts = [
        part for kind, own in groupby(section.parts, type) for part in _shown(kind, list(own), section.title)
    ]
    told = [f"{MARKS[each.level]}: {each.text}" for each in section.findings]
    parts.append(Remarks(told) if told else Text("Nothing found."))
    return Chapter(f"part-{number}", section.title, parts, section.why)


def _shown(kind: type, parts: list[Any], title: str) -> list[Part]:
    """Return parts of one kind that follow each other, as they stand on a page."""
    if kind is str:
        return [Text(f"{_begun(each)}{'' if each.endswith((':', '.')) else '.'}") for each in parts]
    if kind is Listing:
        return [_listing(each, title) for each in parts]
    if kind is Names:
        parts = [Figure(each.heading.capitalize(), ", ".join(each.names)) for each in parts]
    return [Facts(title, [Fact(_begun(each.name.strip()), each.value) for each in parts])]


def _listing(given: Listing, title: str) -> Table:
    columns = []
    for head, layout in given.columns:
        decimals = re.search(r"\.(\d+)f", layout)
        text = not layout.startswith(">")
        columns.append(Column(_begun(head), decimals=int(decimals[1]) if decimals else None, text=text))
    return Table(title, columns, [list(row) for row in given.rows])


def _begun(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]
