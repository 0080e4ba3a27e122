"""What every report for the browser says first: the verdict, and which tests were made."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from photogram.show.page import Cell, Column, Judgement, Remarks, Section, Table, Tone, probability_written

if TYPE_CHECKING:
    from photogram.statistics.verdict import Verdict

MARKS: dict[Tone, str] = {
    "good": "Usable",
    "look": "Usable, but look first",
    "": "Not tested as a whole",
    "bad": "Not to be used as it is",
}


def judged(verdict: Verdict, on: str = "") -> Judgement:
    """Return a verdict as it stands on a page."""
    tested = verdict.is_tested_as_a_whole
    if verdict.exit or verdict.warning:
        tone: Tone = "bad" if verdict.exit else "look"
    else:
        tone = "good" if tested else ""
    mark = "Look first" if tone == "look" and not tested else MARKS[tone]
    return Judgement(mark, verdict.headline, tuple(map(str, verdict.lines)), tone, on)


def verdict_table(verdict: Verdict) -> Table:
    """Return all tests of a verdict."""
    note = (
        "p is the probability of a value as far out where nothing is wrong. A test rejects where it is"
        " below its"
        " level. Of every kind of observation the least probable one stands here."
    )
    return Table.of(
        "Tests",
        verdict.tests,
        [
            (Column("Test", text=True), lambda test: test.name[:1].upper() + test.name[1:]),
            (Column("Statistic", text=True), lambda test: signs_of(test.statistic)),
            (Column("Value"), lambda test: test.value),
            (Column("At least"), lambda test: test.limits[0]),
            (Column("At most"), lambda test: test.limits[1]),
            (Column("p", figures=2), lambda test: Cell(probability_written(test.p), sorts=test.p)),
            (Column("Level", figures=2), lambda test: test.level),
            (Column("Tests that share it", decimals=0), lambda test: test.tests),
            (
                Column("Outcome", text=True),
                lambda test: Cell("passes") if test.accepted else Cell("rejects", tone="look"),
            ),
        ],
        note,
    )


def signs_of(statistic: str) -> str:
    """Return a statistic of a test in the signs of a page."""
    return _STATISTICS.get(statistic, statistic)


def tests_section(verdict: Verdict) -> Section:
    """Return the section of all tests of a verdict; empty, and so not shown, where there are none."""
    return Section("tests", "Tests", [verdict_table(verdict)] if verdict.tests else [])


def remarks_section(sentences: Iterable[object]) -> Section:
    """Return the section of what was remarked on; empty, and so not shown, where that is nothing."""
    told = [str(each) for each in sentences]
    return Section("remarks", "Remarks", [Remarks(told)] if told else [])


_STATISTICS = {"s^2": "s²", "A^2": "A²", "c'C^-1c": "cᵀC⁻¹c"}
