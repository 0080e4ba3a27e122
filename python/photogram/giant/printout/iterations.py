"""Corrections of the camera stations, a page for each iteration (sample, page 25)."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.arguments.types import Floats
from photogram.giant.printout.formats import Space, Values, fixed
from photogram.giant.printout.pages import Page, headed, paginate
from photogram.results.iteration import Iteration

__all__ = ["iteration_pages"]

TITLE = "CAMERA STATIONS CORRECTIONS"


def iteration_pages(
    space: Space,
    names: Sequence[str],
    iterations: Sequence[Iteration],
    corrections: Floats,
    notice: str,
    *,
    as_published: bool = False,
) -> list[Page]:
    """Return the pages of the iterations.

    Parameters
    ----------
    space
        The units of the positions.
    names
        The P stations.
    iterations, corrections
        k iterations, and (k, P, 6) their corrections of position and attitude (radians).
    notice
        What is said below the last one, if anything.
    as_published
        Without the line of the units.
    """
    if not iterations:
        return [[*headed(TITLE), notice]]
    pages = []
    for iteration, values in zip(iterations, corrections.tolist(), strict=True):
        heading = headed(
            TITLE,
            f"ITERATION {iteration.number}",
            *([] if as_published else ["", f"POSITION ({space.units}), ATTITUDE (RADIANS)"]),
        )
        closing = [
            "",
            f"PROVISIONAL WEIGHTED SUM OF SQUARES ={fixed(iteration.weighted_sum_of_squares, 16, 3)}",
        ]
        if notice and iteration is iterations[-1]:
            closing += ["", notice]
        rows = [[_line(name, row)] for name, row in zip(names, values, strict=True)]
        pages += paginate(heading, rows, closing=closing)
    return pages


def _line(name: str, row: Sequence[float]) -> str:
    position, attitude = _numbers(row[:3]), _numbers(row[3:])
    return f"{name:<10}POSITION{position}     ATTITUDE{attitude}"


def _numbers(values: Values) -> str:
    return "".join(fixed(value, 16, 9) for value in values)
