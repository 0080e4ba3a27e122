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
    """Average the residuals of one stage of the adjustment over all cases of a plate."""
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
    averages = []
    for members, _ in together:
        at = np.concatenate([rows[k] for k in members])
        places = _means(at, np.vstack([residuals[k].xy_um for k in members]), len(grid.points))
        values = _means(at, np.vstack([residuals[k].comparator_um for k in members]), len(grid.points))
        measured = np.isfinite(values[:, 0])
        averages.append(
            LocationAverages(
                cases=tuple(cases[k].number for k in members),
                locations=grid.points[measured],
                xy_um=places[measured],
                residuals_um=values[measured],
            )
        )
    return tuple(averages)


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
    """Compute the figures of the listing."""
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


class GridSigma:
    """Grid and random standard deviations of a stage whose squares are unbiased.

    The adjustment is linear in the errors to first order: residuals are W times (grid errors turned into the
    comparator + random errors). The expectations of two sums of squares, of the average residuals and of all
    residuals, follow from W and are linear in the variances; they are equated with the sums. Rigid, linear
    and polynomial parameters are thus taken into account for any placements and points. No matrix of the size
    of the readings is formed: see :mod:`photogram.comparator.reduction`.
    """

    def __init__(
        self,
        grids: Mapping[int, Grid],
        cases: Sequence[PlacedCase],
        stage: CombinedLinear | CombinedPolynomial,
    ) -> None:
        rows = [grids[case.case.plate].rows_of(case.points) for case in cases]
        plates = dict.fromkeys(case.case.plate for case in cases)
        self.reduction = reduction = Reduction.of(stage)
        self.errors = {plate: GridErrors.of(plate, rows, cases, stage) for plate in plates}
        residuals = np.vstack([fit.residuals.comparator_um for fit in stage.cases])
        forms, squares = np.empty((len(plates) + 1, len(plates) + 1)), np.empty(len(plates) + 1)
        for row, errors in enumerate(self.errors.values()):
            forms[row, :-1] = [reduction.averages_of_errors(errors, each) for each in self.errors.values()]
            forms[row, -1] = reduction.averages_of_units(errors)
            squares[row] = float((errors.average(residuals) ** 2).sum())
        forms[-1, :-1] = [reduction.squares_of_errors(errors) for errors in self.errors.values()]
        forms[-1, -1] = reduction.squares_of_units()
        squares[-1] = float((residuals**2).sum())
        sigmas = np.full(len(squares), math.nan)
        if np.linalg.cond(forms / forms.max(axis=1, keepdims=True)) <= 1e8:
            sigmas = np.sqrt(np.maximum(np.linalg.solve(forms, squares), 0.0))
        # Of a grid coordinate of each plate, and of a measured coordinate, micrometres; NaN if the cases do
        # not separate them, 0 if the estimate of a variance is negative
        self.by_plate = dict(zip(plates, sigmas.tolist(), strict=False))
        self.random = float(sigmas[-1])

    def corrected(self, plate: int, known_um: Mapping[int, float | None]) -> float:
        """Return the standard deviation of coordinates of a plate that average residuals have corrected.

        Averages contain a part of the errors of the comparator, and do not show errors that are equal in grid
        and comparator: with few cases corrected coordinates may be worse than good given ones. `known_um` are
        the standard deviations of given coordinates; None: those computed. The root mean square over the
        coordinates, micrometres; NaN if it cannot be determined.
        """
        errors = self.errors[plate]
        squares = self.random**2 * self.reduction.averages_of_units(errors)
        for other, of_other in self.errors.items():
            sigma = self.by_plate[other] if known_um[other] is None else known_um[other] or 0.0
            lost = self.reduction.averages_of_errors(errors, of_other, lost=other == plate)
            squares += sigma**2 * lost
        return math.sqrt(squares / (2 * len(errors.counts)))
