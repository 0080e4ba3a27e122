"""Average residuals (subroutine AVGRES), and the standard deviation of the grid by them (equation 64)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.comparator.case import PlacedCase, exchanged, locations
from photogram.comparator.combined_solution import CombinedLinear, CombinedPolynomial
from photogram.comparator.fits import Residuals
from photogram.comparator.grid import Grid
from photogram.comparator.reduction import GridErrors, Reduction
from photogram.lazy_dataclasses import dataclass

SAME_PLACE = 0.25  # Locations nearer to each other than this part of the spacing of the plate are one


@dataclass(frozen=True, eq=False)
class LocationAverages:
    """Average comparator residuals of the cases in which the plate lay at one place of the comparator."""

    cases: tuple[int, ...]  # Numbers of these cases
    # (m,) numbers of the comparator locations: those of the plate with corner 1 nearest the
    # comparator's zero
    locations: Indices
    xy_um: Floats  # (m, 2) where they are: mean comparator coordinates
    residuals_um: Floats  # (m, 2) averages of the comparator residuals there


@dataclass(frozen=True, eq=False)
class PlateAverages:
    """Average residuals of the cases of one plate, in the axes of its first case.

    X and Y are exchanged against the axes of the plate where that case is left-handed (`left_handed`), as the
    report prints them.
    """

    plate: int  # Number of the plate
    left_handed: bool  # Whether X and Y are exchanged
    cases: tuple[int, ...]  # Numbers of the cases
    points: Indices  # (l,) points of the plate that were measured
    counts: Indices  # (l,) in how many cases
    grid_um: Floats  # (l, 2) averages of the grid residuals by point: the corrections of the grid
    squares_um2: Floats  # (2,) sums of squares of all grid residuals in X and in Y
    # Averages of the comparator residuals, for each place where the plate lay; none where the pattern
    # of the plate does not meet itself when the plate is turned
    by_location: tuple[LocationAverages, ...]
    # (l, 2) coordinates of the last case with corner 1 nearest the comparator's zero, else of the last
    # case; NaN where missing
    xy_um: Floats

    @property
    def location_um(self) -> Floats:
        """(m, 2) averages by location, of all places."""
        return np.vstack([np.empty((0, 2)), *(place.residuals_um for place in self.by_location)])

    @property
    def corrections_um(self) -> Floats:
        """(l, 2) corrections of the grid in the axes of the plate: to be added to the given coordinates."""
        return exchanged(self.grid_um, self.left_handed)


def average_residuals(
    grid: Grid, cases: Sequence[PlacedCase], residuals: Sequence[Residuals]
) -> PlateAverages:
    """Average the residuals of all cases of one plate.

    Parameters
    ----------
    grid
        The plate.
    cases, residuals
        Its cases, and the residuals of one stage of the adjustment.
    """
    left_handed = cases[0].orientation.left_handed
    rows = [grid.rows_of(case.points) for case in cases]
    values = [
        exchanged(own.grid_um, case.orientation.left_handed != left_handed)
        for case, own in zip(cases, residuals, strict=True)
    ]
    all_rows, all_values = np.concatenate(rows), np.vstack(values)
    counts = np.bincount(all_rows, minlength=len(grid.points))
    measured = np.flatnonzero(counts)
    last = max(range(len(cases)), key=lambda k: (cases[k].orientation.corner == 1, k))
    xy = np.full((len(grid.points), 2), np.nan)
    xy[rows[last]] = residuals[last].xy_um
    return PlateAverages(
        plate=grid.number,
        left_handed=left_handed,
        cases=tuple(case.number for case in cases),
        points=grid.points[measured],
        counts=counts[measured],
        grid_um=_means(all_rows, all_values, len(grid.points))[measured],
        squares_um2=(all_values**2).sum(axis=0),
        by_location=_by_location(grid, cases, residuals),
        xy_um=xy[measured],
    )


def _by_location(
    grid: Grid, cases: Sequence[PlacedCase], residuals: Sequence[Residuals]
) -> tuple[LocationAverages, ...]:
    """Average by location; cases whose plate lay elsewhere have other locations, whatever their numbers."""
    maps = {case.orientation.corner: locations(grid, case.orientation.corner) for case in cases}
    rows = []
    for case in cases:
        numbers = maps[case.orientation.corner]
        if numbers is None:
            return ()
        rows.append(grid.rows_of(numbers[grid.rows_of(case.points)]))
    extent = np.ptp(grid.xy_um, axis=0)
    apart = SAME_PLACE * math.sqrt(float(extent.prod()) / len(grid.points))
    together: list[tuple[list[int], Floats]] = []
    for k, own in enumerate(residuals):
        for members, places in together:
            away = np.abs(own.xy_um - places[rows[k]])
            if np.isfinite(away).any() and np.nanmax(away) < apart:
                members.append(k)
                known = np.isfinite(places[rows[k], 0])
                places[rows[k][~known]] = own.xy_um[~known]
                break
        else:
            places = np.full((len(grid.points), 2), np.nan)
            places[rows[k]] = own.xy_um
            together.append(([k], places))
    return tuple(_averaged(grid, members, cases, rows, residuals) for members, _ in together)


def _averaged(
    grid: Grid,
    members: list[int],
    cases: Sequence[PlacedCase],
    rows: Sequence[Indices],
    residuals: Sequence[Residuals],
) -> LocationAverages:
    own = np.concatenate([rows[k] for k in members])
    places = _means(own, np.vstack([residuals[k].xy_um for k in members]), len(grid.points))
    values = _means(own, np.vstack([residuals[k].comparator_um for k in members]), len(grid.points))
    measured = np.isfinite(values[:, 0])
    return LocationAverages(
        tuple(cases[k].number for k in members), grid.points[measured], places[measured], values[measured]
    )


def _means(rows: Indices, values: Floats, count: int) -> Floats:
    """Average values by row; NaN where there are none."""
    counts = np.bincount(rows, minlength=count)
    sums = np.column_stack([np.bincount(rows, weights=values[:, axis], minlength=count) for axis in range(2)])
    means: Floats = np.divide(
        sums, counts[:, np.newaxis], out=np.full(sums.shape, np.nan), where=counts[:, None] > 0
    )
    return means


@dataclass(frozen=True)
class ListedGridSigma:
    """What the listing prints under the average residuals (figure 29), micrometres.

    "STANDARD DEVIATION", roots of the sums of squares of both axes over 2 N - 1; "RANDOM ERRORS" in X and in
    Y, NaN for one case; "UNBIASED GRID STANDARD ERROR", 0 where the difference of variances is negative, or
    for one case.
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

    Returns micrometres; 0 where the difference of variances is negative, NaN where every point was measured
    once.
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
    grid_rows: Sequence[Indices],
    cases: Sequence[PlacedCase],
    stage: CombinedLinear | CombinedPolynomial,
) -> tuple[dict[int, float], float]:
    """Compute grid and random standard deviations whose squares are unbiased.

    The adjustment is linear in the errors to first order: residuals are W times (grid errors turned into the
    comparator + random errors). The expectations of two sums of squares, of the average residuals and of all
    residuals, follow from W and are linear in the variances; they are equated with what was found. Rigid,
    linear and polynomial parameters are thus accounted for, whatever placements and points there are. No
    matrix of the size of the readings is formed: see :mod:`photogram.comparator.reduction`. `grid_rows` are
    for each case the rows of its points on its plate.

    Returns the standard deviation of a grid coordinate of each plate, and of a measured coordinate; NaN where
    the cases do not separate them, 0 where the estimate of a variance is negative.
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
    grid_rows: Sequence[Indices],
    cases: Sequence[PlacedCase],
    stage: CombinedLinear | CombinedPolynomial,
    known_um: Mapping[int, float | None],
) -> dict[int, float]:
    """Compute the standard deviation of grid coordinates that average residuals have corrected.

    Averages take over a part of the errors of the comparator, and do not show what looks alike in the grid
    and in the comparator: with few cases corrected coordinates may be worse than good given ones. Where
    deviations of given coordinates are not known those computed hold. Returns the root mean square over the
    coordinates of each plate, micrometres; NaN where it cannot be known.
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
    grid_rows: Sequence[Indices], cases: Sequence[PlacedCase], stage: CombinedLinear | CombinedPolynomial
) -> tuple[Reduction, dict[int, GridErrors]]:
    """Return what the adjustment leaves of errors, and how those of each plate come in."""
    plates = dict.fromkeys(case.case.plate for case in cases)
    return Reduction.of(stage), {plate: GridErrors.of(plate, grid_rows, cases, stage) for plate in plates}
