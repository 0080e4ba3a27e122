"""Standard deviation of the grid from average residuals (NOAA TR NOS 57, equations 64 and 65)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.combined_solution import CombinedLinear, CombinedPolynomial
from photogram.comparator.reduction import GridErrors, Reduction
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.comparator.averages import PlateAverages
    from photogram.comparator.case import PlacedCase
    from photogram.comparator.readings import Integers

__all__ = [
    "ListedGridSigma",
    "corrected_grid_sigma",
    "listed_grid_sigma",
    "text_grid_sigma",
    "unbiased_grid_sigma",
]


@dataclass(frozen=True)
class ListedGridSigma:
    """What the listing prints under the average residuals (figure 29), micrometres.

    Attributes
    ----------
    mean_comparator_um, mean_grid_um
        "STANDARD DEVIATION": root of the sum of squares of both axes over 2 N - 1.
    random_um
        "RANDOM ERRORS" in X and in Y; NaN for one case.
    grid_um
        "UNBIASED GRID STANDARD ERROR"; 0 where the difference of variances is negative, or for one case.
    """

    mean_comparator_um: float
    mean_grid_um: float
    random_um: tuple[float, float]
    grid_um: float


def listed_grid_sigma(averages: PlateAverages) -> ListedGridSigma:
    """Compute the figures of the listing.

    They divide by 2 N - 1, and pass over what the fitted parameters take: the grid sigma of 25 points comes
    out 5 percent small.
    """
    points, cases = len(averages.points), len(averages.cases)
    squares = (averages.grid_um**2).sum(axis=0)
    mean = math.sqrt(float(squares.sum()) / (2 * points - 1))
    location = averages.location_um
    of_locations = (
        math.sqrt(float((location**2).sum()) / (2 * len(location) - 1)) if len(location) else math.nan
    )
    if cases < 2:
        return ListedGridSigma(of_locations, mean, (math.nan, math.nan), 0.0)
    within = np.maximum(0.0, averages.squares_um2 - cases * squares) / (points * cases * (cases - 1))
    return ListedGridSigma(
        of_locations,
        mean,
        (math.sqrt(within[0]), math.sqrt(within[1])),
        math.sqrt(max(0.0, mean**2 - float(within.sum()) / 2)),
    )


def text_grid_sigma(averages: PlateAverages) -> float:
    """Compute the grid sigma by equation 64, for unequal numbers of cases a point, both axes pooled.

    Returns
    -------
    Micrometres; 0 where the difference of variances is negative, NaN where every point was measured once.
    """
    counts = averages.counts.astype(float)
    total, points = counts.sum(), len(counts)
    if total <= points:
        return math.nan
    between = float((counts[:, np.newaxis] * averages.grid_um**2).sum()) / 2
    within = max(0.0, float(averages.squares_um2.sum()) / 2 - between)
    factor = total * (points - 1) / (total**2 - (counts**2).sum())
    variance = factor * (between / (points - 1) - within / (total - points))
    return math.sqrt(max(0.0, variance))


def unbiased_grid_sigma(
    grid_rows: Sequence[Integers],
    cases: Sequence[PlacedCase],
    stage: CombinedLinear | CombinedPolynomial,
) -> tuple[dict[int, float], float]:
    """Compute grid and random standard deviations whose squares are unbiased.

    The adjustment is linear in the errors to first order: residuals are W times (grid errors turned into the
    comparator + random errors). The expectations of two sums of squares, of the average residuals and of all
    residuals, follow from W and are linear in the variances; they are equated with what was found. Rigid,
    linear and polynomial parameters are thus accounted for, whatever placements and points there are. No
    matrix of the size of the readings is formed: see :mod:`photogram.comparator.reduction`.

    Parameters
    ----------
    grid_rows
        For each case the rows of its points on its plate.
    cases, stage
        The cases, and the stage of the adjustment that left the residuals.

    Returns
    -------
    grid_um, random_um
        Standard deviation of a grid coordinate of each plate, and of a measured coordinate; NaN where the
        cases do not separate them, 0 where the estimate of a variance is negative.
    """
    reduction, errors = _effects(grid_rows, cases, stage)
    plates = list(errors)
    residuals = np.vstack([fit.residuals.comparator_um for fit in stage.cases])
    forms = np.empty((len(plates) + 1, len(plates) + 1))
    found = np.empty(len(plates) + 1)
    for row, plate in enumerate(plates):
        own = errors[plate]
        forms[row, :-1] = [reduction.averages_of_errors(own, errors[other]) for other in plates]
        forms[row, -1] = reduction.averages_of_units(own)
        found[row] = float((own.average(residuals) ** 2).sum())
    forms[-1, :-1] = [reduction.squares_of_errors(errors[plate]) for plate in plates]
    forms[-1, -1] = reduction.squares_of_units()
    found[-1] = float((residuals**2).sum())
    if np.linalg.cond(forms / forms.max(axis=1, keepdims=True)) > 1e8:
        return dict.fromkeys(plates, math.nan), math.nan
    variances = np.linalg.solve(forms, found)
    sigmas = [math.sqrt(max(0.0, float(variance))) for variance in variances]
    return dict(zip(plates, sigmas, strict=False)), sigmas[-1]


def corrected_grid_sigma(
    grid_rows: Sequence[Integers],
    cases: Sequence[PlacedCase],
    stage: CombinedLinear | CombinedPolynomial,
    known_um: Mapping[int, float | None],
) -> dict[int, float]:
    """Compute the standard deviation of grid coordinates that average residuals have corrected.

    Averages take over a part of the errors of the comparator, and do not show what looks alike in the grid
    and in the comparator: with few cases corrected coordinates may be worse than good given ones.

    Parameters
    ----------
    grid_rows, cases, stage
        As of :func:`unbiased_grid_sigma`.
    known_um
        Standard deviations of the given coordinates; None where they are not known: those computed hold.

    Returns
    -------
    Root mean square over the coordinates of each plate, micrometres; NaN where it cannot be known.
    """
    computed, random = unbiased_grid_sigma(grid_rows, cases, stage)
    reduction, errors = _effects(grid_rows, cases, stage)
    given = {plate: computed[plate] if known_um[plate] is None else known_um[plate] for plate in errors}
    return {
        plate: math.sqrt(
            (
                random**2 * reduction.averages_of_units(own)
                + sum(
                    (given[other] or 0.0) ** 2
                    * reduction.averages_of_errors(own, errors[other], lost=other == plate)
                    for other in errors
                )
            )
            / (2 * len(own.counts))
        )
        for plate, own in errors.items()
    }


def _effects(
    grid_rows: Sequence[Integers], cases: Sequence[PlacedCase], stage: CombinedLinear | CombinedPolynomial
) -> tuple[Reduction, dict[int, GridErrors]]:
    """Return what the adjustment leaves of errors, and how those of each plate come in."""
    plates = dict.fromkeys(case.case.plate for case in cases)
    return Reduction.of(stage), {plate: GridErrors.of(plate, grid_rows, cases, stage) for plate in plates}
