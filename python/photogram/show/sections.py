"""Reports as text: a first line, then titled sections."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from photogram import _photocore
from photogram.messages import Message
from photogram.show.page import probability_written
from photogram.statistics.evidence import Test
from photogram.statistics.limits import GlobalTest
from photogram.statistics.verdict import Verdict

Section = tuple[str, list[str]]
"""A title and lines."""


def headline(what: str, title: str = "") -> str:
    """Return the first line of a report: who made it, what it is, and the title of the job."""
    return f"photogram {_photocore.__version__}  {what}  {title}".rstrip()


def composed(head: str, sections: Iterable[Section]) -> str:
    """Return a report: its first line, then the sections; those without lines are left out."""
    parts = [f"{title}\n{'-' * len(title)}\n" + "\n".join(lines) for title, lines in sections if lines]
    return "\n\n".join([head, *parts]) + "\n"


def verdict_sections(verdict: Verdict) -> list[Section]:
    """Return what stands on top of every report: the verdict, and what to do next."""
    return [("Verdict", _judged(verdict)), ("What to do next", list(map(str, verdict.next)))]


def _judged(verdict: Verdict) -> list[str]:
    """Return the verdict in a sentence, remarks, and the tests."""
    lines = [f"{verdict.headline}.", *(f"{line[:1].upper()}{line[1:]}." for line in map(str, verdict.lines))]
    if verdict.tests:
        lines += [f"{'test':<54}{'value':>14}{'limits':>20}{'p':>10}{'level':>10}{'tests':>8}"]
        lines += [line for test in verdict.tests for line in _test_lines(test)]
    return lines


def _test_lines(test: Test) -> list[str]:
    """Write a test: its name on a line of its own where that is long."""
    low, high = test.limits
    if high is None:
        limits = "-"
    elif low is None:
        limits = f"to {high:.4g}"
    else:
        limits = f"{low:.4g} to {high:.4g}"
    p = probability_written(test.p)
    figures = (
        f"{f'{test.statistic} = {test.value:.4g}':>14}{limits:>20}{p:>10}{test.level:>10.2g}{test.tests:>8}"
        f"{'' if test.accepted else '  rejected'}"
    )
    name = test.name
    return [f"{name:<54}{figures}"] if len(name) < 54 else [name, f"{'':<54}{figures}"]


def problems(
    messages: Sequence[Message],
    status: str,
    variance_of_unit_weight: float | None,
    test: GlobalTest | None = None,
) -> list[str]:
    """Return what keeps a reader from using the values of an adjustment, or should make them careful.

    The gravest first: no convergence, then a failed global test.
    """
    found = [str(message) for message in messages]
    if test is not None and (failed := test.problem()):
        found.insert(0, failed)
    if status != "converged":
        found.insert(0, f"the adjustment has {status}: do not use these values")
    if variance_of_unit_weight is None:
        found.append("there are no degrees of freedom: covariances are scaled by 1")
    return found


def problems_or_none(messages: Iterable[Message | str], verdict: Verdict) -> list[str]:
    """Return messages, or that there are none: beside the verdict, where that has something to say."""
    found = [str(message) for message in messages]
    good = verdict.usable and not verdict.warning and all(test.accepted for test in verdict.tests)
    return found or ["none" if good else "none beside those of the verdict"]
