"""The adjustment: corrections of stations, residuals (sample, pages 25-29)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from photogram.arguments.types import Floats
from photogram.giant.printout.forms import Page, Space, Values, fixed, headed, paginate
from photogram.lazy_dataclasses import dataclass
from photogram.results.parts import Iteration, SumsByKind

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
    """Return pages of k iterations with corrections (k, P, 6), radians.

    The notice is below the last one; the published form lacks the line with the units.
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


ACROSS = 10  # Frames per line


@dataclass(frozen=True)
class PointResiduals:
    """Residuals (k, 2) of a point, observed minus computed, mm, on k frames."""

    name: str
    frames: Sequence[str]
    residuals: Floats

    def listed(self, limit: float) -> bool:
        """Whether COMMON columns 41-50 (millimetres) select this point."""
        return limit == 0 or (limit > 0 and bool((abs(self.residuals) > limit).any()))


def residual_pages(
    points: Iterable[PointResiduals], limit: float, closing: Sequence[str], *, as_published: bool = False
) -> list[Page]:
    """Return the pages of residuals, with `closing` (:func:`statistics`) below.

    The limit is in COMMON columns 41-50; the published form lacks the definition of the residuals.
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


def statistics(sums: SumsByKind, degrees_of_freedom: float, variance: float | None) -> list[str]:
    """Return weighted sums of squares and estimates of unit weight."""
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
