"""What every report for the browser says first: what to do next, and which tests were made."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from photogram.show.page import Cell, Column, Judgement, Remarks, Section, Table, Tone

if TYPE_CHECKING:
    from photogram.statistics.evidence import Test
    from photogram.statistics.verdict import Verdict

__all__ = ["advice", "judged", "remarks_section", "tests_section", "verdict_table"]

MARKS: dict[Tone, str] = {
    "good": "Usable",
    "look": "Usable, but look first",
    "": "Not tested as a whole",
    "bad": "Not to be used as it is",
}
"""What stands above a verdict: colours alone say nothing."""

LEAST = 1e-99
"""Smaller probabilities are not told apart."""

_NEXT = {
    "not-converged": (
        "Do not use any figure of this page: they are those of the last iteration, not of a solution.",
        "Look for mistakes of the input first: {check}. Poor first values are the usual cause.",
    ),
    "undetermined": (
        "Measure what determines the unknowns that are named, or hold them; {check} says more.",
    ),
    "hint": ("Correct what is named above, and adjust again.",),
    "identification": ("Look at the exposures that are named, and leave out those that are wrong.",),
    "changed": (
        "Values of before a change hold for what was measured before it, those of after it for what came"
        " after: one mean holds for neither.",
        "Look for the cause (wear, repair, temperature), and for what was measured in between.",
    ),
    "gross-errors": (
        "Look at the observations that are named: the first of them is the most likely, those after it"
        " often only follow from it. They are in the table of the worst observations.",
        "{snoop}",
    ),
    "usable-after-removal": (
        "Look at what was taken out, and measure it again if it matters.",
        "Standard deviations hold after the removal: the largest residuals are gone.",
    ),
    "set-aside": (
        "Look at the images that are named: they are probably of other points, or their photos of something"
        " else.",
    ),
    "too-much-set-aside": (
        "So many images are not wrong by themselves. Look for what they have in common: a camera, a lens"
        " that is not modelled, wrong control; {check}.",
    ),
    "too-much-removed": (
        "So many observations are not wrong by themselves. Look for what they have in common: a camera, a"
        " day, a wrong control system; {check}.",
    ),
    "check-points": (
        "Look at the check points that are named: their names, given coordinates, kind of heights, images. If"
        " they are right, the block is wrong there, where its own residuals cannot show it: look for control"
        " or a camera that bends it; {check}.",
        "Do not hand over the standard deviations of this page before the cause is known.",
    ),
    "look-at-check-points": (
        "Look at the check points that are named. Among good ones as many as these are rare: their given"
        " coordinates, or what stands for their standard deviations, may be at fault.",
    ),
    "weights": (
        "The covariances on this page are scaled by the unit variance already.",
        "Give the observations standard deviations that are larger by the factor that is named, so that"
        " their tests are right too.",
    ),
    "weights-of-groups": (
        "Give the groups that are named standard deviations larger or smaller by their factors, and adjust"
        " again.",
    ),
    "model": (
        "{calibrate}",
        "Look at the residuals over the frame: what is alike in all photos is the camera, what is alike in"
        " one is the photo or its control. Do not take out observations before: where the model is wrong,"
        " good ones look bad.",
    ),
    "uncontrolled": (
        "Nothing checks these values. Measure more than is needed: more rays, control or distances.",
    ),
    "unexplained": (
        "Look at the largest tests and at the residuals over the frame; {check} looks for mistakes of the"
        " input.",
        "{snoop}",
    ),
    "look-at": (
        "Look at the observations that are named. Among good observations as many as these are rare: keep"
        " them if the measurement is beyond doubt.",
    ),
    "weights-pessimistic": (
        "The covariances on this page are scaled by the unit variance already. Give smaller standard"
        " deviations, unless values were smoothed or used twice.",
    ),
    "accepted": (),
    "not-tested": (
        "No test says whether the standard deviations are right: compare with what took no part (known"
        " values, a second measurement), or give the observations standard deviations where the program takes"
        " them.",
    ),
}
"""What follows from the condition that gave the headline, in the words of a program."""


def advice(
    verdict: Verdict, *, check: str = "", snoop: str = "", calibrate: str = "", others: Sequence[str] = ()
) -> list[str]:
    """Return what to do next.

    Parameters
    ----------
    verdict
        What was found.
    check
        How the program looks for mistakes of the input, as part of a sentence.
    snoop, calibrate
        Sentences on how gross errors are taken out, and how cameras are calibrated; nothing where the
        program cannot.
    others
        What follows from other things than the verdict; it stands after that.
    """
    words = {"check": check or "look at the input", "snoop": snoop, "calibrate": calibrate}
    found = [each.format(**words) for each in _NEXT.get(verdict.code, ())]
    return [each for each in (*found, *others) if each]


def judged(verdict: Verdict, on: str = "") -> Judgement:
    """Return a verdict as it stands on a page."""
    tested = any(test.name == "global" for test in verdict.tests)
    if verdict.exit or verdict.warning:
        tone: Tone = "bad" if verdict.exit else "look"
    else:
        tone = "good" if tested else ""
    mark = "Look first" if tone == "look" and not tested else MARKS[tone]
    return Judgement(mark, verdict.headline, verdict.lines, tone, on)


def verdict_table(verdict: Verdict, of: str = "") -> Table:
    """Return all tests of a verdict."""
    columns = (
        Column("Test", text=True),
        Column("Statistic", text=True),
        Column("Value"),
        Column("At least"),
        Column("At most"),
        Column("p", figures=2),
        Column("Level", figures=2),
        Column("Tests that share it", decimals=0),
        Column("Outcome", text=True),
    )
    caption = f"Tests of {of}" if of else "Tests"
    note = (
        "p is the probability of a value as far out where nothing is wrong. A test rejects where it is"
        " below its"
        " level. Of every kind of observation the least probable one stands here."
    )
    return Table(caption, columns, [_row(each) for each in verdict.tests], note)


def tests_section(verdict: Verdict) -> Section:
    """Return the section of all tests of a verdict; empty, and so not shown, where there are none."""
    return Section("tests", "Tests", [verdict_table(verdict)] if verdict.tests else [])


def remarks_section(sentences: Iterable[object]) -> Section:
    """Return the section of what was remarked on; empty, and so not shown, where that is nothing."""
    told = [said for each in sentences if (said := str(each)) != "none"]
    return Section("remarks", "Remarks", [Remarks(told)] if told else [])


def _row(test: Test) -> list[Cell | str | float | None]:
    low, high = test.limits
    p = Cell("< 1e-99", sorts=0.0) if test.p < LEAST else test.p
    outcome = Cell("passes") if test.accepted else Cell("rejects", tone="look")
    name = test.name[:1].upper() + test.name[1:]
    return [
        name,
        _STATISTICS.get(test.statistic, test.statistic),
        test.value,
        low,
        high,
        p,
        test.level,
        test.tests,
        outcome,
    ]


_STATISTICS = {"s^2": "s²", "A^2": "A²", "c'C^-1c": "c′C⁻¹c"}
