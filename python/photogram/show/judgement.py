"""The verdict and the tests, at the start of each HTML report."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.show.page import Document, Judgement, Remarks, Section, Tone
from photogram.show.quantity import Quantity, Table
from photogram.words import Words, words_of

if TYPE_CHECKING:
    from photogram.statistics.verdict import Verdict

MARKS: dict[Tone, str] = {
    "good": "Usable",
    "look": "Usable, but look first",
    "": "Not tested as a whole",
    "bad": "Not to be used as it is",
}


def judged(verdict: Verdict, on: str = "") -> Judgement:
    tested = verdict.is_tested_as_a_whole
    tone: Tone = "bad" if verdict.exit else "look" if verdict.warning else "good" if tested else ""
    mark = "Look first" if tone == "look" and not tested else MARKS[tone]
    return Judgement(mark, verdict.headline, tuple(map(str, verdict.lines)), tone, on)


def verdict_document(verdict: Verdict, what: str, title: str, **fields: Any) -> Document:
    """Return a document with headline and next steps of a verdict, and its JSON member."""
    document = Document(what, title, [judged(verdict)], verdict.next, **fields)
    return document.with_members(lambda: {"verdict": verdict.document()})


def verdict_table(verdict: Verdict, words: Words | None = None) -> Table:
    """Return all tests of a verdict, in English or with the words of another language."""
    words, tests = words or words_of("en"), verdict.tests
    names = [f"{words.text(each.kind, '^')}: {words.text(each.subject)}".removesuffix(": ") for each in tests]
    outcomes = [words("test.passes" if each.accepted else "test.rejects") for each in tests]
    p, level = (np.array([getattr(each, name) for each in tests]) for name in ("p", "level"))
    columns: list[tuple[str, Any, dict[str, Any]]] = [
        ("test", names, {"kind": "name"}),
        ("statistic", [_STATISTICS.get(each.statistic, each.statistic) for each in tests], {"kind": "name"}),
        ("value", [each.value for each in tests], {"figures": 4}),
        ("low", [each.limits[0] for each in tests], {"figures": 4}),
        ("high", [each.limits[1] for each in tests], {"figures": 4}),
        ("p", p, {"kind": "probability"}),
        ("level", level, {"kind": "probability"}),
        ("tests", [each.tests for each in tests], {"decimals": 0}),
        ("outcome", outcomes, {"kind": "name", "marked": np.array([not each.accepted for each in tests])}),
    ]
    quantities = [Quantity(values, head=words(f"column.{key}"), **more) for key, values, more in columns]
    return Table("tests", words("table.tests"), quantities, words("table.tests.note"))


def remarks_section(sentences: Iterable[object]) -> Section:
    return Section("remarks", "Remarks", [Remarks([str(each) for each in sentences])])


_STATISTICS = {"s^2": "s²", "A^2": "A²", "c'C^-1c": "cᵀC⁻¹c"}
