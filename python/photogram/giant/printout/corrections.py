"""Corrections applied to ground control (sample, page 35)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.giant.printout.formats import Space
from photogram.giant.printout.pages import Page, headed, paginate
from photogram.giant.printout.summaries import counts_and_rms

__all__ = ["correction_pages"]

ACROSS = 4
"""Points on a line."""


def correction_pages(
    space: Space, names: Sequence[str], corrections: Floats, held: NDArray[np.bool_], *, as_published: bool
) -> list[Page]:
    """Return the pages of the corrections.

    Parameters
    ----------
    space
        How positions are written.
    names, corrections, held
        n points, their (n, 3) corrections (NaN where there is none), and (n, 3) which components are held.
    as_published
        Without the line that says what is listed, and without number and rms of the components that are not
        held.
    """
    meaning = "ADJUSTED MINUS INPUT; IN PARENTHESES: COMPONENT NOT HELD, ADJUSTED MINUS SUPPLIED VALUE"
    heading = headed("CORRECTIONS APPLIED TO GROUND CONTROL", *([] if as_published else [meaning]))
    cells = [_cells(space, *row) for row in zip(names, corrections.tolist(), held.tolist(), strict=True)]
    entries = [
        [*("".join(cell[line] for cell in cells[row : row + ACROSS]) for line in range(3)), ""]
        for row in range(0, len(cells), ACROSS)
    ]
    known = np.isfinite(corrections)
    closing = _summary(space, corrections, known & held)
    if not as_published:
        closing += ["", "COMPONENTS NOT HELD", *_summary(space, corrections, known & ~held)]
    return paginate(heading, entries, closing=closing)


def _cells(space: Space, name: str, values: Sequence[float], held: Sequence[bool]) -> list[str]:
    """Three lines of 33 columns: the name, the label, and 17 for the value with its parentheses."""
    rows = zip(("", name, ""), space.names, space.values(values, 3), held, strict=True)
    return [
        f"{ident:<9}{axis}={f' {value} ' if is_held else f'({value})'}   "
        for ident, axis, value, is_held in rows
    ]


def _summary(space: Space, corrections: Floats, counted: NDArray[np.bool_]) -> list[str]:
    counts, rms = counts_and_rms(corrections, counted)
    rows = zip(space.names, counts, space.values(rms, 3), strict=True)
    return [f"{axis}     NUMBER OF COMPONENTS ={count:>6d}     RMS ={value}" for axis, count, value in rows]
