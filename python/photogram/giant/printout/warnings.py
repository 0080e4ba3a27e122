"""Warnings about points and control (sample, page 24; GIANT guide, section III)."""

from __future__ import annotations

from collections.abc import Iterable

from photogram.giant.diagnostics import ErrorWarning
from photogram.giant.printout.pages import Page, paginate

__all__ = ["warning_pages"]

ACROSS = 4
"""Names on a line."""


def warning_pages(warnings: Iterable[ErrorWarning]) -> list[Page]:
    """Return the pages of the warnings; none where there is nothing to warn of."""
    entries = [entry for warning in warnings for entry in _entries(warning)]
    return paginate([""], entries) if entries else []


def _entries(warning: ErrorWarning) -> list[list[str]]:
    """Keep the heading with the first names."""
    heading = ["ERROR WARNINGS", ""] if warning.general else []
    names = [
        ["".join(f"{name:<20}" for name in warning.names[row : row + ACROSS])]
        for row in range(0, len(warning.names), ACROSS)
    ]
    return [[*heading, warning.heading, "", *names[0]], *names[1:], ["", ""]]
