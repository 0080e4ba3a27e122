"""Residuals of the plate coordinates and what they add up to (sample, pages 26 to 29)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from photogram.arguments.types import Floats
from photogram.giant.printout.formats import fixed
from photogram.giant.printout.pages import Page, headed, paginate
from photogram.lazy_dataclasses import dataclass
from photogram.results.result import SumsOfSquares

__all__ = ["PointResiduals", "residual_pages", "statistics"]

ACROSS = 10
"""Frames on a line."""


@dataclass(frozen=True)
class PointResiduals:
    """The residuals of a point.

    Attributes
    ----------
    name
        The point.
    frames
        The k frames on which it was measured.
    residuals
        (k, 2) observed minus computed, in millimetres.
    """

    name: str
    frames: Sequence[str]
    residuals: Floats

    def listed(self, limit: float) -> bool:
        """Whether COMMON columns 41-50 (millimetres) ask for this point."""
        return limit == 0 or (limit > 0 and bool((abs(self.residuals) > limit).any()))


def residual_pages(
    points: Iterable[PointResiduals], limit: float, closing: Sequence[str], *, as_published: bool = False
) -> list[Page]:
    """Return the pages of the residuals.

    Parameters
    ----------
    points
        Residuals in processing order.
    limit
        COMMON columns 41-50.
    closing
        What stands below: :func:`statistics`.
    as_published
        Without the line that says what the residuals are.
    """
    meaning = "OBSERVED MINUS COMPUTED, MICROMETERS; X ABOVE Y".center(132).rstrip()
    heading = headed("TRIANGULATED POINTS RESIDUALS", *([] if as_published else [meaning]))
    entries = (entry for point in points if point.listed(limit) for entry in _entries(point))
    return paginate(heading, entries, closing=closing)


def _entries(point: PointResiduals) -> list[list[str]]:
    entries = []
    micrometres = (1000 * point.residuals).round().astype(int).tolist()
    for row in range(0, len(point.frames), ACROSS):
        frames, values = point.frames[row : row + ACROSS], micrometres[row : row + ACROSS]
        entries.append(
            [
                f"{'' if row else point.name:<10}" + "".join(f"{frame:>12}" for frame in frames),
                f"{'':10}" + "".join(f"{x:>12d}" for x, _ in values),
                f"{'':10}" + "".join(f"{y:>12d}" for _, y in values),
                "",
            ]
        )
    return entries


def statistics(sums: SumsOfSquares, degrees_of_freedom: float, variance: float | None) -> list[str]:
    """Return the weighted sums of squares and the estimates for unit weight; `variance` None is undefined."""
    parts = {"CAMERA": sums.camera, "GROUND": sums.ground, "PLATES": sums.plates, "TOTAL": sums.total}
    lines = [
        f"{f'WEIGHTED SUM OF SQUARES ({name})':<40} ={fixed(size, 16, 3)}" for name, size in parts.items()
    ]
    estimates = {"VARIANCE": variance, "ST. DEV.": None if variance is None else math.sqrt(variance)}
    return [
        "",
        *lines,
        f"{'DEGREES OF FREEDOM':.<40} ={degrees_of_freedom:>12.0f}",
        "",
        "A POSTERIORI ESTIMATES FOR UNIT WEIGHT",
        *(
            f"{name:>40} ={'UNDEFINED'.rjust(16) if value is None else fixed(value, 16, 3)}"
            for name, value in estimates.items()
        ),
    ]
