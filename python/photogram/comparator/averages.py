"""Average residuals (subroutine AVGRES), and the grid standard deviation from them (equation 64)."""

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

SAME_PLACE = 0.25  # Locations closer than this part of the plate spacing are equal


@dataclass(frozen=True, eq=False)
class LocationAverages:
    """Average comparator residuals of the cases with one plate position."""

    cases: tuple[int, ...]  # Numbers of these cases
    # (m,) numbers of the comparator locations: the points of the plate with corner 1 nearest the zero of the
    # comparator
    locations: Indices
    xy_um: Floats  # (m, 2) locations: mean comparator coordinates
    residuals_um: Floats  # (m, 2) averages of the comparator residuals


@dataclass(frozen=True, eq=False)
class PlateAverages:
    """Average residuals of the cases of one plate, in the axes of its first case.

    X and Y are exchanged relative to the plate if that case is left-handed (`left_handed`), as in the printed
    report.
    """

    plate: int  # Number of the plate
    left_handed: bool  # Whether X and Y are exchanged
    cases: tuple[int, ...]  # Numbers of the cases
    points: Indices  # (l,) points of the plate that were measured
    counts: Indices  # (l,) number of cases per point
    grid_um: Floats  # (l, 2) averages of the grid residuals by point: the corrections of the grid
    squares_um2: Floats  # (2,) sums of squares of all grid residuals in X and in Y
    # Averages of the comparator residuals for each plate position. Empty if the pattern of the rotated plate
    # does not coincide with itself
    by_location: tuple[LocationAverages, ...]
    # (l, 2) coordinates of the last case with corner 1 nearest the zero of the comparator, else of the last
    # case; NaN where missing
    xy_um: Floats

    @property
    def location_um(self) -> Floats:
        """(m, 2) averages of all locations."""
        return np.vstack([np.empty((0, 2)), *(place.residuals_um for place in self.by_location)])

    @property
    def corrections_um(self) -> Floats:
        """(l, 2) additive corrections of the grid in the axes of the plate."""
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
    """Average by location.

    Cases with other plate positions have separate locations, independent of their numbers.
    """
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
        averaged = tuple(cases[k].number for k in members)
        averages.append(LocationAverages(averaged, grid.points[measured], places[measured], values[measured]))
    return tuple(averages)


def _means(rows: Indices, values: Floats, count: int) -> Floats:
    counts = np.bincount(rows, minlength=count)
    sums = np.column_stack([np.bincount(rows, weights=values[:, axis], minlength=count) for axis in range(2)])
    means: Floats = np.divide(
        sums, counts[:, np.newaxis], out=np.full(sums.shape, np.nan), where=counts[:, None] > 0
    )
    return means


@dataclass(frozen=True)
class ListedGridSigma:
    """Standard deviations below the average residuals in the listing, micrometres.

    "STANDARD DEVIATION" (figure 29): roots of the sums of squares of both axes over 2 N - 1. "RANDOM ERRORS"
    in X and in Y: NaN for one case. "UNBIASED GRID STANDARD ERROR": 0 for one case, or if the difference of
    variances is negative.
    """

    mean_comparator_um: float
    mean_grid_um: float
    random_um: tuple[float, float]
    grid_um: float


def listed_grid_sigma(averages: PlateAverages) -> ListedGridSigma:
    """Compute the standard deviations of the listing."""
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
    """Compute the grid sigma by equation 64, pooled over both axes.

    Numbers of cases per point may differ. Returns micrometres; 0 if the difference of variances is negative,
    NaN if every point was measured once.
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
    """Grid and random standard deviations of a stage from unbiased sums of squares.

    The adjustment is linear in the errors to first order: residuals are W times errors. These are grid
    errors, rotated into the comparator, plus random errors. W gives the expectations of two sums of squares,
    for average residuals and for all residuals. They are linear in the variances and are equated with the
    sums. This accounts for rigid, linear and polynomial parameters with any placements and points. No matrix
    of the size of the readings is formed: see :mod:`photogram.comparator.reduction`.
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
        # Standard deviations of a grid coordinate of each plate and of a measured coordinate, micrometres.
        # NaN if the cases do not separate them, 0 if the estimated variance is negative
        self.by_plate = dict(zip(plates, sigmas.tolist(), strict=False))
        self.random = float(sigmas[-1])

    def corrected(self, plate: int, known_um: Mapping[int, float | None]) -> float:
        """Return the standard deviation of grid coordinates after averaged corrections.

        Averages contain a part of the comparator errors, and do not show equal errors of grid and comparator.
        With few cases, corrected coordinates may be worse than accurate given ones. `known_um` contains the
        standard deviations of given coordinates; None: use the computed ones. The result is the root mean
        square over the coordinates, micrometres; NaN if it cannot be determined.
        """
        errors = self.errors[plate]
        squares = self.random**2 * self.reduction.averages_of_units(errors)
        for other, of_other in self.errors.items():
            sigma = self.by_plate[other] if known_um[other] is None else known_um[other] or 0.0
            lost = self.reduction.averages_of_errors(errors, of_other, lost=other == plate)
            squares += sigma**2 * lost
        return math.sqrt(squares / (2 * len(errors.counts)))
