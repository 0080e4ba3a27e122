"""Sections of text: a title with lines."""

from __future__ import annotations

from collections.abc import Iterable

from photogram import _photocore

Section = tuple[str, list[str]]
"""A title and lines."""


def headline(what: str, title: str = "") -> str:
    """Return the first line of a report: who made it, what it is, and the title of the job."""
    return f"photogram {_photocore.__version__}  {what}  {title}".rstrip()


def composed(head: str, sections: Iterable[Section]) -> str:
    """Return a report: its first line, then the sections; those without lines are left out."""
    parts = [f"{title}\n{'-' * len(title)}\n" + "\n".join(lines) for title, lines in sections if lines]
    return "\n\n".join([head, *parts]) + "\n"
