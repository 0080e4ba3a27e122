"""Parts of large results that plots show, with notes on the omitted parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from photogram.arguments.arrays import sampled
from photogram.arguments.types import Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import replace
from photogram.show.sketch.marks import Panel
from photogram.words import phrase

T = TypeVar("T")


def thinned(what: str, rows: Indices, most: int) -> tuple[Indices, str]:
    """Return the rows to draw among many, and a remark."""
    remark = f"{most:,} of {len(rows):,} {what} are drawn, taken at random" if len(rows) > most else ""
    return sampled(rows, most), remark


def first_panels(
    plot: str, what: str, parts: Sequence[T], most: int, draw: Callable[[T], Panel]
) -> list[Panel]:
    """Return panels of the first parts, with a note if there are more."""
    if not parts:
        raise InputError(phrase(f"plot.{plot}"))
    panels = [draw(part) for part in parts[:most]]
    if len(parts) > most:
        note = f"the first {most} of {len(parts)} {what} are drawn"
        panels[-1] = replace(panels[-1], notes=[*panels[-1].notes, note])
    return panels
