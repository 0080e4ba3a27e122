"""The rigorous adjustment: cases, comparator, polynomials and grid at once, with their covariances.

The engine underneath (`photocore::programs::comparator`) takes grid points as local unknowns, each weighted
by the standard deviation of the grid, cases as kept ones, and the comparator as the border. Weights: the
variance of a mean is that of the comparator, random, plus that of a pointing over their number; the random
part, and the grid's where it is not known, are estimated from the residuals.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.comparator.case import PlacedCase
from photogram.comparator.combined_solution import CombinedLinear
from photogram.comparator.correction import PARAMETERS, Correction
from photogram.comparator.fits import Residuals, rotation_matrix
from photogram.comparator.grid import Grid
from photogram.comparator.polynomial import COUNT, Frame, Polynomial
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.limits import GlobalTest, global_test

DEGREE = 4
OWN_TERMS = 6  # Terms of the polynomials that the linear parameters do not repeat: the first six
ROUNDS = 100
SETTLED = 1e-6
LEAST_UM = 1e-3  # Standard deviations are not estimated below a nanometre


@dataclass(frozen=True)
class Weights:
    """What the weights come from.

    Attributes
    ----------
    grid_um
        Standard deviation of a grid coordinate, by plate: zero holds the grid fixed; None estimates it.
    pointing_um
        Standard deviations of a single pointing in x and in y.
    random_um
        Standard deviation of the comparator itself; None estimates it.
    """

    grid_um: Mapping[int, float | None]
    pointing_um: tuple[float, float] = (0.0, 0.0)
    random_um: float | None = None


@dataclass(frozen=True, eq=False)
class JointCase:
    """A case after the joint adjustment."""

    number: int  # Of the case
    rotation_rad: float  # grid = M(rotation) corrected + translation, in the handedness of the comparator
    translation_um: Floats
    # (3, 3) of rotation (rad) and the grid coordinates of the centre of the polynomials' frame (um)
    covariance: Floats
    residuals: Residuals  # In both systems
    # (n, 2) residuals of measured coordinates over their standard deviations; NaN where nothing checks
    # them
    standardized: Floats


@dataclass(frozen=True, eq=False)
class JointPlate:
    """A plate after the joint adjustment, in its own axes."""

    points: Indices  # (l,) points measured
    corrections_um: Floats  # (l, 2) adjusted less given coordinates
    covariance_um2: Floats  # (l, 2, 2) of the adjusted coordinates
    sigma_um: float  # Standard deviation of a given coordinate, and whether it was estimated
    estimated: bool
    # Variance of the corrections over the one assumed; near 1 when the latter is right. None for a
    # fixed grid
    variance_ratio: float | None
    # Of the corrections against the standard deviation a priori; None where it was estimated or fixed
    test: GlobalTest | None


@dataclass(frozen=True, eq=False)
class JointFit:
    """The joint adjustment."""

    correction: Correction  # Comparator and polynomials with the covariance of all of them
    # Standard deviation of unit weight; dimensionless, 1 where weights are right. Covariances are
    # scaled by its square
    sigma0: float
    degrees_of_freedom: int  # Of the last adjustment
    iterations: int
    random_um: float  # Standard deviation of the comparator itself
    cases: tuple[JointCase, ...]  # Cases in the order measured, plates by number
    plates: dict[int, JointPlate]

    @property
    def covariance(self) -> Floats:
        """(3, 3) of scale x, scale y, lack of orthogonality (rad)."""
        return self.correction.covariance[:3, :3]


@dataclass(frozen=True, eq=False)
class _Arrays:
    """The problem as the extension module takes it."""

    grid_xy: Floats
    plate_of: Indices
    measured_cases: Indices
    measured_points: Indices
    measured_xy: Floats
    counts: Indices
    placements: Floats
    left_handed: list[bool]
    frame: Frame
    coefficient_sd: list[float]


def adjust_jointly(
    cases: Sequence[PlacedCase],
    grids: Mapping[int, Grid],
    linear: CombinedLinear,
    weights: Weights,
    *,
    polynomial: bool = True,
) -> JointFit:
    """Adjust everything together, from the combined linear adjustment, with or without polynomials."""
    arrays, points_of = _arrays(cases, grids, linear, polynomial)
    random = weights.random_um if weights.random_um is not None else max(linear.sigma0_um, LEAST_UM)
    grid = {plate: random / 2 if sigma is None else sigma for plate, sigma in weights.grid_um.items()}
    for _ in range(ROUNDS):
        variance, solution = _solve(arrays, grid, weights.pointing_um, random)
        known = (random, dict(grid))
        if weights.random_um is None:
            random = _random(arrays, solution, variance, weights.pointing_um)
        for plate in grid:
            if weights.grid_um[plate] is None:
                grid[plate] *= math.sqrt(max(_grid_ratio(arrays, solution, plate, grid[plate]), 0.01))
                grid[plate] = max(grid[plate], LEAST_UM)
        changes = [abs(random - known[0]), *(abs(grid[plate] - known[1][plate]) for plate in grid)]
        if max(changes) <= SETTLED * max(known[0], LEAST_UM):
            break
    return _result(cases, arrays, points_of, solution, variance, known[0], known[1], weights)


def _arrays(
    cases: Sequence[PlacedCase], grids: Mapping[int, Grid], linear: CombinedLinear, polynomial: bool
) -> tuple[_Arrays, dict[int, Indices]]:
    """Return the problem: points numbered through, placements counted from the middle of the range."""
    plates = list(dict.fromkeys(case.case.plate for case in cases))
    points_of = {
        plate: np.unique(np.concatenate([case.points for case in cases if case.case.plate == plate]))
        for plate in plates
    }
    first = dict(zip(plates, np.cumsum([0, *(len(points) for points in points_of.values())]), strict=False))
    frame = Frame.of(np.vstack([fit.residuals.xy_um for fit in linear.cases]))
    placements = [
        [fit.rotation_rad, *(rotation_matrix(fit.rotation_rad) @ frame.centre_um + fit.translation_um)]
        for fit in linear.cases
    ]
    arrays = _Arrays(
        grid_xy=np.vstack([grids[plate].xy_um[grids[plate].rows_of(points_of[plate])] for plate in plates]),
        plate_of=np.repeat(plates, [len(points_of[plate]) for plate in plates]),
        measured_cases=np.repeat(np.arange(len(cases)), [len(case.points) for case in cases]),
        measured_points=np.concatenate(
            [
                first[case.case.plate] + np.searchsorted(points_of[case.case.plate], case.points)
                for case in cases
            ]
        ),
        measured_xy=np.vstack([case.means_um for case in cases]),
        counts=np.concatenate([case.counts for case in cases]),
        placements=np.array(placements),
        left_handed=[case.orientation.left_handed for case in cases],
        frame=frame,
        coefficient_sd=[math.inf if polynomial else 0.0] * OWN_TERMS,
    )
    return arrays, points_of


def _solve(
    arrays: _Arrays, grid: Mapping[int, float], pointing: tuple[float, float], random: float
) -> tuple[Floats, _photocore.ComparatorSolution]:
    """Adjust with given standard deviations; return the variances of the means (m, 2) and the solution."""
    variance = random**2 + np.array(pointing) ** 2 / arrays.counts[:, np.newaxis]
    sd = np.array([grid[plate] for plate in arrays.plate_of.tolist()])
    try:
        solution = _photocore.adjust_comparator(
            arrays.grid_xy,
            np.column_stack([sd, sd]),
            arrays.placements,
            arrays.left_handed,
            arrays.measured_cases,
            arrays.measured_points,
            arrays.measured_xy,
            np.sqrt(variance),
            ([0.0] * OWN_TERMS, [0.0] * OWN_TERMS),
            (arrays.coefficient_sd, arrays.coefficient_sd),
            degree=DEGREE,
            centre=arrays.frame.centre_um,
            half_range=arrays.frame.half_range_um,
            limit=1e-5,
            max_iterations=50,
        )
    except _photocore.ComparatorError as error:
        raise AdjustmentError(f"joint adjustment: {error.args[0]}") from None
    if not solution.converged:
        raise AdjustmentError("the joint adjustment does not converge")
    return variance, solution


def _random(
    arrays: _Arrays,
    solution: _photocore.ComparatorSolution,
    variance: Floats,
    pointing: tuple[float, float],
) -> float:
    """Estimate the comparator: weighted squares of residuals must equal their redundancy."""
    ratio = float((solution.residuals**2 / variance).sum() / solution.redundancy.sum())
    known = np.array(pointing) ** 2 / arrays.counts[:, np.newaxis]
    return math.sqrt(max(ratio * float(variance.mean()) - float(known.mean()), LEAST_UM**2))


def _grid_ratio(
    arrays: _Arrays, solution: _photocore.ComparatorSolution, plate: int, sigma_um: float
) -> float:
    """Weighted squares of the corrections of a plate over their redundancy."""
    squares, redundancy = _grid_squares(arrays, solution, plate, sigma_um)
    return squares / float(redundancy.sum()) if redundancy.sum() > 1e-9 else 1.0


def _grid_test(
    arrays: _Arrays, solution: _photocore.ComparatorSolution, plate: int, sigma_um: float
) -> GlobalTest | None:
    """Test the corrections of a plate against their standard deviation.

    Their weighted squares are nearly c times chi-square with g degrees of freedom, of the same mean and
    variance (Satterthwaite): c = sum r^2 / sum r, g = sum r / c.
    """
    squares, redundancy = _grid_squares(arrays, solution, plate, sigma_um)
    if redundancy.sum() <= 1e-9:
        return None
    part = float((redundancy**2).sum() / redundancy.sum())
    return global_test(squares / part, float(redundancy.sum()) / part)


def _grid_squares(
    arrays: _Arrays, solution: _photocore.ComparatorSolution, plate: int, sigma_um: float
) -> tuple[float, Floats]:
    """Return the weighted squares of the corrections of a plate, and their redundancy numbers."""
    own = arrays.plate_of == plate
    corrections = solution.grid_xy[own] - arrays.grid_xy[own]
    return float((corrections**2).sum()) / sigma_um**2, solution.grid_redundancy[own]


def _result(
    cases: Sequence[PlacedCase],
    arrays: _Arrays,
    points_of: Mapping[int, Indices],
    solution: _photocore.ComparatorSolution,
    variance: Floats,
    random: float,
    grid: Mapping[int, float],
    weights: Weights,
) -> JointFit:
    dof = solution.degrees_of_freedom
    scale = solution.sum_of_squares / dof if dof > 0 else 1.0
    correction = _correction(arrays.frame, solution, scale)
    return JointFit(
        correction=correction,
        sigma0=math.sqrt(scale),
        degrees_of_freedom=dof,
        iterations=solution.iterations,
        random_um=random,
        cases=tuple(
            _case(k, case, arrays, correction, solution, variance, scale) for k, case in enumerate(cases)
        ),
        plates={
            plate: _plate(arrays, points, solution, plate, grid[plate], weights, scale)
            for plate, points in points_of.items()
        },
    )


def _correction(frame: Frame, solution: _photocore.ComparatorSolution, scale: float) -> Correction:
    """Put the parameters among the 21 of a correction: terms of degree 1 and 0 are zero in this frame."""
    place = np.concatenate([np.arange(3 + OWN_TERMS), 3 + COUNT + np.arange(OWN_TERMS)])
    values, covariance = np.zeros(PARAMETERS), np.zeros((PARAMETERS, PARAMETERS))
    values[place] = solution.comparator
    covariance[np.ix_(place, place)] = scale * solution.comparator_cofactors
    polynomial = Polynomial(frame, values[3:].reshape(2, COUNT), covariance[3:, 3:] / scale)
    scale_x, scale_y, lean = values[:3].tolist()
    return Correction(scale_x, scale_y, lean, polynomial, covariance)


def _case(
    k: int,
    case: PlacedCase,
    arrays: _Arrays,
    correction: Correction,
    solution: _photocore.ComparatorSolution,
    variance: Floats,
    scale: float,
) -> JointCase:
    own = arrays.measured_cases == k
    rotation, *centre = solution.case_placements[k].tolist()
    matrix = rotation_matrix(rotation)
    observed = solution.residuals[own]
    deviation = np.sqrt(scale * variance[own] * solution.redundancy[own])
    residuals = Residuals(
        case.points, correction.apply(case.means_um), -observed, np.asarray(observed @ matrix.T), math.nan
    )
    return JointCase(
        number=case.number,
        rotation_rad=rotation,
        translation_um=np.asarray(centre - matrix @ arrays.frame.centre_um),
        covariance=scale * solution.case_cofactors[k],
        residuals=residuals,
        standardized=np.divide(
            -observed, deviation, out=np.full(observed.shape, np.nan), where=solution.redundancy[own] > 1e-6
        ),
    )


def _plate(
    arrays: _Arrays,
    points: Indices,
    solution: _photocore.ComparatorSolution,
    plate: int,
    sigma_um: float,
    weights: Weights,
    scale: float,
) -> JointPlate:
    own = arrays.plate_of == plate
    estimated = weights.grid_um[plate] is None
    return JointPlate(
        points=points,
        corrections_um=np.asarray(solution.grid_xy[own] - arrays.grid_xy[own]),
        covariance_um2=scale * solution.grid_cofactors[own],
        sigma_um=sigma_um,
        estimated=estimated,
        variance_ratio=_grid_ratio(arrays, solution, plate, sigma_um) if sigma_um > 0 else None,
        test=_grid_test(arrays, solution, plate, sigma_um) if sigma_um > 0 and not estimated else None,
    )
