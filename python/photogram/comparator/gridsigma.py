"""Standard deviation of the grid from average residuals (NOAA TR NOS 57, equations 64 and 65)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.combined import CombinedLinear, CombinedPolynomial
from photogram.comparator.polynomial import COUNT, Frame, design

if TYPE_CHECKING:
    from photogram.adjusted import Floats
    from photogram.comparator.averages import PlateAverages
    from photogram.comparator.placed import PlacedCase
    from photogram.comparator.readings import Integers

__all__ = ["ListedGridSigma", "listed_grid_sigma", "text_grid_sigma", "unbiased_grid_sigma"]


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
        math.nan if location is None else math.sqrt(float((location**2).sum()) / (2 * len(location) - 1))
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
    linear and polynomial parameters are thus accounted for, whatever placements and points there are.

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
    plates = list(dict.fromkeys(case.case.plate for case in cases))
    reduce = _reduction(stage, with_polynomial=isinstance(stage, CombinedPolynomial))
    residuals = np.concatenate([fit.residuals.comparator_um.ravel() for fit in stage.cases])
    spread = {plate: _grid_errors(plate, grid_rows, cases, stage) for plate in plates}
    average = {plate: _averaging(matrix) for plate, matrix in spread.items()}
    unit = reduce(np.eye(len(residuals)))
    effect = {plate: reduce(matrix) for plate, matrix in spread.items()}
    forms = np.empty((len(plates) + 1, len(plates) + 1))
    found = np.empty(len(plates) + 1)
    for row, plate in enumerate(plates):
        forms[row] = [_square(average[plate] @ effect[other]) for other in plates] + [
            _square(average[plate] @ unit)
        ]
        found[row] = _square(average[plate] @ residuals)
    forms[-1] = [_square(effect[plate]) for plate in plates] + [_square(unit)]
    found[-1] = _square(residuals)
    if np.linalg.cond(forms / forms.max(axis=1, keepdims=True)) > 1e8:
        return dict.fromkeys(plates, math.nan), math.nan
    variances = np.linalg.solve(forms, found)
    sigmas = [math.sqrt(max(0.0, float(variance))) for variance in variances]
    return dict(zip(plates, sigmas, strict=False)), sigmas[-1]


def _square(values: Floats) -> float:
    return float((values**2).sum())


def _grid_errors(
    plate: int,
    grid_rows: Sequence[Integers],
    cases: Sequence[PlacedCase],
    stage: CombinedLinear | CombinedPolynomial,
) -> Floats:
    """Return the effect of errors of the grid on the comparator residuals: v = M^T e, a row a coordinate."""
    own = [k for k, case in enumerate(cases) if case.case.plate == plate]
    points = np.unique(np.concatenate([grid_rows[k] for k in own]))
    blocks = []
    for k, case in enumerate(cases):
        block = np.zeros((2 * len(case.points), 2 * len(points)))
        if k in own:
            c, s = math.cos(stage.cases[k].rotation_rad), math.sin(stage.cases[k].rotation_rad)
            turn = np.array([[c, -s], [s, c]])
            if case.orientation.left_handed:
                turn = turn[:, ::-1]
            columns = np.searchsorted(points, grid_rows[k])
            for row, column in enumerate(columns.tolist()):
                block[2 * row : 2 * row + 2, 2 * column : 2 * column + 2] = turn
        blocks.append(block)
    return np.vstack(blocks)


def _averaging(spread: Floats) -> Floats:
    """Return what averages comparator residuals, turned into the grid system, by point (sign apart)."""
    return np.asarray(spread.T / (spread**2).sum(axis=0)[:, np.newaxis])


def _reduction(stage: CombinedLinear | CombinedPolynomial, *, with_polynomial: bool) -> _Reduction:
    """Return what takes errors of readings to residuals, as the stages of the adjustment do."""
    places = [fit.residuals.xy_um for fit in stage.cases]
    everywhere = np.vstack(places)
    functions = design(Frame.of(everywhere), everywhere)
    zero = np.zeros_like(functions)
    # Rows alternate between x and y.
    both = np.stack([np.hstack([functions, zero]), np.hstack([zero, functions])], axis=1).reshape(
        -1, 2 * COUNT
    )
    rigid = np.zeros((len(both), 3 * len(places)))
    start = 0
    for k, own in enumerate(places):
        rows = slice(start, start + 2 * len(own))
        x, y = (own - own.mean(axis=0)).T / 1e5
        rigid[rows, 3 * k : 3 * k + 3] = np.stack(
            [np.column_stack([x * 0 + 1, y * 0, -y]), np.column_stack([x * 0, y * 0 + 1, x])], axis=1
        ).reshape(-1, 3)
        start = rows.stop
    # Scales and lack of orthogonality: x in x, y in y, y in x (columns of both: x x, ..., see TERMS).
    linear = np.hstack([rigid, both[:, [6, COUNT + 7, 7]]])
    steps = [linear, both, rigid] if with_polynomial else [linear]
    return _Reduction([np.linalg.qr(step)[0] for step in steps])


class _Reduction:
    """Residuals of one least-squares fit after the other."""

    def __init__(self, bases: list[Floats]) -> None:
        self.bases = bases

    def __call__(self, values: Floats) -> Floats:
        for basis in self.bases:
            values = values - basis @ (basis.T @ values)
        return values
