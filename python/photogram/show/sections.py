"""Reports as text: a first line, then titled sections."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from photogram import _photocore
from photogram.messages import Message
from photogram.statistics.limits import GlobalTest

__all__ = ["Section", "composed", "headline", "problems"]

Section = tuple[str, list[str]]
"""A title and lines."""


def headline(what: str, title: str = "") -> str:
    """Return the first line of a report: who made it, what it is, and the title of the job."""
    return f"photogram {_photocore.__version__}  {what}  {title}".rstrip()


def composed(head: str, sections: Iterable[Section]) -> str:
    """Return a report: its first line, then the sections; those without lines are left out."""
    parts = [f"{title}\n{'-' * len(title)}\n" + "\n".join(lines) for title, lines in sections if lines]
    return "\n\n".join([head, *parts]) + "\n"


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
    return found or ["none"]
