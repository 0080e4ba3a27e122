"""Average residuals (subroutine AVGRES), and the grid standard deviation from them (equation 64).

Its unbiased form needs the residual effects of errors: traces of products with the reduction R, in linear
memory. With polynomials, the stages of the report are rigid and linear parameters, polynomials, and rigid
parameters again. This gives

    R = (I - P P^T) (I - B B^T) (I - F F^T) = I - U W^T, U = [F, (I - P P^T) B], W = [F, (I - F F^T) B].

The columns of P are rotation and translations of every case, F = [P, L] those of P and the linear parameters,
B the polynomials (all orthonormal). Sums of squares require only small products of U, W and the errors of the
grid:

    |A R E|^2 = |A E|^2 - 2 tr((A E)^T (A U) (E^T W)^T) + tr((A U)^T (A U) (E^T W)^T (E^T W)).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.comparator.case import PlacedCase, exchanged, locations
from photogram.comparator.fits import Frame, Residuals, design, rotation_matrix
from photogram.comparator.grid import Grid
from photogram.comparator.variance import CombinedLinear, CombinedPolynomial
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

    The adjustment is linear in the errors to first order: residuals are R times errors. These are grid
    errors, rotated into the comparator, plus random errors. R gives the expectations of two sums of squares,
    for average residuals and for all residuals. They are linear in the variances and are equated with the
    sums. This accounts for rigid, linear and polynomial parameters with any placements and points. No matrix
    of the size of the readings is formed: see :mod:`photogram.comparator.averages`.
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
        self.errors = {plate: GridErrors(plate, rows, cases, stage, reduction) for plate in plates}
        residuals = np.vstack([fit.residuals.comparator_um for fit in stage.cases])
        forms, squares = np.empty((len(plates) + 1, len(plates) + 1)), np.empty(len(plates) + 1)
        for row, errors in enumerate(self.errors.values()):
            forms[row, :-1] = [reduction.averages_of_errors(errors, each) for each in self.errors.values()]
            forms[row, -1] = reduction.averages_of_units(errors)
            gathered = errors.gathered(residuals[..., np.newaxis])[..., 0]
            squares[row] = float(((gathered.T / errors.counts) ** 2).sum())
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


class GridErrors:
    """Coordinate errors e of one plate and their effect on residuals, v = E e."""

    def __init__(
        self,
        plate: int,
        grid_rows: Sequence[Indices],
        cases: Sequence[PlacedCase],
        stage: CombinedLinear | CombinedPolynomial,
        reduction: Reduction,
    ) -> None:
        own = [k for k, case in enumerate(cases) if case.case.plate == plate]
        sizes = [len(case.points) for case in cases]
        ends, turns = np.cumsum(sizes), []
        for k in own:
            turn = rotation_matrix(stage.cases[k].rotation_rad).T
            turns.append(exchanged(turn, cases[k].orientation.left_handed))
        points = np.concatenate([grid_rows[k] for k in own])
        order = np.argsort(points, kind="stable")
        # Measured point of each non-zero block of E, sorted by plate point, and the first block of each point
        self.rows = np.concatenate([np.arange(ends[k] - sizes[k], ends[k]) for k in own])[order]
        self.starts = np.flatnonzero(np.diff(points[order], prepend=-1))
        # (n, 2, 2) blocks: rotations, mirrored if the comparator is left-handed
        self.turns = np.repeat(turns, [sizes[k] for k in own], axis=0)[order]
        self.counts = np.diff([*self.starts, len(order)])  # Number of cases per point
        # E^T U and E^T W, A U and A W, and (A U)^T (A U), (E^T W)^T (E^T W)
        self.left, self.right = self.gathered(reduction.left), self.gathered(reduction.right)
        self.mean_left, self.mean_right = ((each.T / self.counts).T for each in (self.left, self.right))
        self.products = _product(self.mean_left, self.mean_left), _product(self.right, self.right)

    def gathered(self, values: Floats) -> Floats:
        """Return E^T times columns: (measured points, 2, k) to (plate points, 2, k)."""
        turned = self.turns.transpose(0, 2, 1) @ values[self.rows]
        return np.asarray(np.add.reduceat(turned, self.starts))


@dataclass(frozen=True, eq=False)
class Reduction:
    """Reduction R = I - U W^T for m measured points in case order."""

    left: Floats  # (m, 2, k) U and W
    right: Floats

    @classmethod
    def of(cls, stage: CombinedLinear | CombinedPolynomial) -> Reduction:
        """Return the reduction of reading errors to residuals of a stage."""
        places = [fit.residuals.xy_um for fit in stage.cases]
        everywhere, ends = np.vstack(places), np.cumsum([len(own) for own in places])
        rigid = np.zeros((len(everywhere), 2, 3 * len(places)))
        for k, (own, end) in enumerate(zip(places, ends.tolist(), strict=True)):
            away = own - own.mean(axis=0)
            x, y = away.T / np.linalg.norm(away)
            columns = rigid[end - len(own) : end, :, 3 * k : 3 * k + 3]
            columns[:, 0, 0] = columns[:, 1, 1] = 1 / math.sqrt(len(own))
            columns[:, 0, 2], columns[:, 1, 2] = -y, x
        frame = Frame.of(everywhere)
        arguments = frame.arguments(everywhere)
        # Columns of the scales and of the lack of orthogonality
        scales = np.zeros((len(arguments), 2, 3))
        scales[:, 0, 0], scales[:, 1, 1], scales[:, 0, 2] = arguments[:, 0], arguments[:, 1], arguments[:, 1]
        linear = np.linalg.qr(_without(rigid, scales).reshape(-1, 3))[0].reshape(scales.shape)
        first = np.concatenate([rigid, linear], axis=2)
        if isinstance(stage, CombinedLinear):
            return cls(first, first)
        functions = np.linalg.qr(design(frame, everywhere))[0]
        both = np.einsum("nk,ij->nijk", functions, np.eye(2)).reshape(len(functions), 2, -1)
        left, right = _without(rigid, both), _without(first, both)
        return cls(np.concatenate([first, left], axis=2), np.concatenate([first, right], axis=2))

    @cached_property
    def products(self) -> tuple[Floats, Floats]:
        """U^T U and W^T W."""
        return _product(self.left, self.left), _product(self.right, self.right)

    def variances(self) -> Floats:
        """Return the diagonal of R R^T, (m, 2): residual variances for unit variance."""
        left = self.left @ self.products[1] - 2 * self.right
        return np.asarray(1 + (left * self.left).sum(axis=2))

    def squares_of_units(self) -> float:
        """Sum of squares of R: expected squares of residuals for unit variance."""
        return self.left[..., 0].size + _squares(self.left, self.right, *self.products)

    def squares_of_errors(self, errors: GridErrors) -> float:
        """Sum of squares of R E."""
        products = self.products[0], errors.products[1]
        return 2 * len(errors.rows) + _squares(errors.left, errors.right, *products)

    def averages_of_units(self, errors: GridErrors) -> float:
        """Sum of squares of A R, with A the average by point."""
        products = errors.products[0], self.products[1]
        return float((2 / errors.counts).sum()) + _squares(errors.mean_left, errors.mean_right, *products)

    def averages_of_errors(self, averaged: GridErrors, errors: GridErrors, *, lost: bool = False) -> float:
        """Sum of squares of A R E, A of one plate, E of the same or another.

        With `lost`, sum of squares of I - A R E of one plate: the errors that averages do not show.
        """
        products = averaged.products[0], errors.products[1]
        if averaged is not errors or lost:  # A E = 0, or subtracted
            return float((products[0] * products[1]).sum())
        return 2 * len(errors.counts) + _squares(averaged.mean_left, errors.right, *products)


def _product(first: Floats, second: Floats) -> Floats:
    """Return the products of all columns (m, 2, j) with all columns (m, 2, k)."""
    return np.asarray(np.tensordot(first, second, axes=((0, 1), (0, 1))))


def _without(basis: Floats, columns: Floats) -> Floats:
    """Return columns without their projection on an orthonormal basis."""
    return np.asarray(columns - basis @ _product(basis, columns))


def _squares(one: Floats, other: Floats, left: Floats, right: Floats) -> float:
    """Return the last two traces of |A R E|^2: of two factors, and of the products of columns."""
    return float((left * right).sum() - 2 * (one * other).sum())
