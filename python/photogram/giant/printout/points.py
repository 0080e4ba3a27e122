"""The adjusted ground points (sample, pages 32 to 34; with covariances pages 43 to 54)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.giant.printout.formats import VALUE, Space
from photogram.giant.printout.matrices import MATRIX, matrix_rows
from photogram.giant.printout.pages import Page, headed, paginate
from photogram.giant.printout.summaries import counts_and_rms

__all__ = ["point_pages", "propagated_point_pages"]

TITLE = "TRIANGULATED GROUND POINTS"
IDENT = 18
"""Columns of the name and the mark of control."""
POSITION = VALUE + 5
"""Columns of `LNG =` and its value."""


def point_pages(space: Space, names: Sequence[str], marks: Sequence[str], positions: Floats) -> list[Page]:
    """Return the pages without error propagation: a line for each point, 52 on a page.

    Parameters
    ----------
    space
        How positions are written.
    names, marks, positions
        The n points, their marks (`*code*` for control, else nothing), and (n, 3) positions.
    """
    heading = headed(TITLE, f"{'IDENT':<{IDENT}}{'POSITION':^72}".rstrip())
    return paginate(
        heading,
        (
            [_ident(name, mark) + "   ".join(_labelled(space, space.values(position, 3)))]
            for name, mark, position in zip(names, marks, positions.tolist(), strict=True)
        ),
    )


def propagated_point_pages(
    space: Space,
    names: Sequence[str],
    marks: Sequence[str],
    positions: Floats,
    covariances: Floats,
    held: NDArray[np.bool_],
) -> list[Page]:
    """Return the pages with error propagation: three lines for each point, 13 on a page, and a summary.

    Parameters
    ----------
    space, names, marks, positions
        As in :func:`point_pages`.
    covariances
        (n, 3, 3).
    held
        (n, 3): components that are held do not count in the summary.
    """
    heading = headed(
        TITLE,
        f"{'IDENT':<{IDENT}}{'POSITION':^{POSITION}}{'COVARIANCE MATRIX':^{MATRIX}}"
        f"   {'STANDARD DEV':^{VALUE}}".rstrip(),
    )
    deviations = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    rows = zip(names, marks, positions.tolist(), covariances, deviations.tolist(), strict=True)
    entries = (_entry(space, *row) for row in rows)
    return paginate(heading, entries, closing=_summary(space, deviations, ~held))


def _entry(
    space: Space,
    name: str,
    mark: str,
    position: Iterable[float],
    covariance: Floats,
    deviations: Iterable[float],
) -> list[str]:
    rows = zip(
        ("", _ident(name, mark), ""),
        _labelled(space, space.values(position, 4)),
        matrix_rows(covariance),
        space.values(deviations, 4),
        strict=True,
    )
    lines = [f"{ident:<{IDENT}}{value}{matrix}   {sd}" for ident, value, matrix, sd in rows]
    return [*lines, ""]


def _ident(name: str, mark: str) -> str:
    return f"{f'{name:<10}{mark}':<{IDENT}}"


def _labelled(space: Space, values: Iterable[str]) -> list[str]:
    return [f"{name} ={value}" for name, value in zip(space.names, values, strict=True)]


def _summary(space: Space, deviations: Floats, counted: NDArray[np.bool_]) -> list[str]:
    counts, rms = counts_and_rms(deviations, counted)
    rows = zip(counts, _labelled(space, space.values(rms, 4)), strict=True)
    return [
        "SUMMARY STATISTICS FOR GROUND POINTS",
        "RMS FOR STANDARD DEVIATIONS",
        "",
        *(f"COUNT ={count:>7d}     {value}" for count, value in rows),
    ]
