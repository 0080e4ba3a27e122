"""Rigorous joint adjustment of cases, comparator, polynomials and grid, with covariances.

The engine (`photogram_programs::comparator`) uses grid points as local unknowns, weighted by the standard
deviation of the grid. Cases are retained unknowns, and the comparator is the border. The variance of a mean
is the random comparator variance plus the pointing variance over the number of pointings. The random part,
and an unknown grid variance, are estimated from the residuals.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.comparator.case import PlacedCase
from photogram.comparator.correction import PARAMETERS, Correction
from photogram.comparator.fits import COUNT, Frame, Polynomial, Residuals, rotation_matrix
from photogram.comparator.grid import Grid
from photogram.comparator.variance import CombinedLinear
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import phrase

DEGREE = 4
OWN_TERMS = 6  # The first six polynomial terms, which are independent of the linear parameters
MAX_ROUNDS = 100
SETTLED = 1e-6  # relative change of standard deviations
LEAST_UM = 1e-3  # Lower limit of estimated standard deviations, a nanometre


@dataclass(frozen=True, eq=False)
class JointCase:
    number: int  # Number of the case
    rotation_rad: float  # grid = M(rotation) corrected + translation, in the handedness of the comparator
    translation_um: Floats
    # (3, 3) of rotation (rad) and the grid coordinates of the polynomial frame's centre (um)
    covariance: Floats
    residuals: Residuals  # Residuals in both systems
    # (n, 2) residuals of measured coordinates over their standard deviations; NaN if not checked
    standardized: Floats


@dataclass(frozen=True, eq=False)
class JointPlate:
    points: Indices  # (l,) measured points
    corrections_um: Floats  # (l, 2) adjusted minus given coordinates
    covariance_um2: Floats  # (l, 2, 2) covariance of the adjusted coordinates
    sigma_um: float  # Standard deviation of a given coordinate, and whether it was estimated
    estimated: bool
    # Variance of the corrections over the assumed one; near 1 if the latter is correct. None for a fixed grid
    variance_ratio: float | None
    # Test of the corrections against the a priori sd; None if it was estimated or fixed
    test: GlobalTest | None

    @property
    def sd_um(self) -> Floats:
        """(l, 2) standard deviations of the adjusted coordinates."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance_um2, axis1=1, axis2=2)))


@dataclass(frozen=True, eq=False)
class JointFit:
    correction: Correction  # Comparator and polynomials with their joint covariance
    # Standard deviation of unit weight; dimensionless, 1 for correct weights. Covariances are scaled by its
    # square
    sigma0: float
    degrees_of_freedom: int  # Degrees of freedom of the last adjustment
    iterations: int
    random_um: float  # Standard deviation of the comparator
    cases: tuple[JointCase, ...]  # Cases in the order measured, plates by number
    plates: dict[int, JointPlate]

    @property
    def covariance(self) -> Floats:
        """(3, 3) covariance of scale x, scale y, lack of orthogonality (rad)."""
        return self.correction.covariance[:3, :3]


def adjust_jointly(
    cases: Sequence[PlacedCase],
    grids: Mapping[int, Grid],
    linear: CombinedLinear,
    grid_um: Mapping[int, float | None],
    *,
    pointing_um: tuple[float, float] = (0.0, 0.0),
    random_um: float | None = None,
    polynomial: bool = True,
) -> JointFit:
    """Adjust all cases jointly, starting from the combined linear adjustment.

    Weights follow from standard deviations: of grid coordinates by plate (zero fixes the grid), of a single
    pointing in x and in y, and of the comparator. None estimates them.
    """
    problem = _Problem(cases, grids, linear, grid_um, pointing_um, polynomial)
    random = random_um if random_um is not None else max(linear.sigma0_um, LEAST_UM)
    grid = {plate: random / 2 if sigma is None else sigma for plate, sigma in grid_um.items()}
    for _ in range(MAX_ROUNDS):
        problem.solve(grid, random)
        before, grid_before = random, dict(grid)
        if random_um is None:
            random = problem.random()
        for plate in grid:
            if grid_um[plate] is None:
                grid[plate] *= math.sqrt(max(problem.grid_test(plate, grid[plate])[0], 0.01))
                grid[plate] = max(grid[plate], LEAST_UM)
        changes = [abs(random - before), *(abs(grid[plate] - grid_before[plate]) for plate in grid)]
        if max(changes) <= SETTLED * max(before, LEAST_UM):
            break
    return problem.fit(before, grid_before)


class _Problem:
    """Problem of the extension module, and its last solution.

    Points are numbered through all plates. Placements refer to the centre of the range.
    """

    solution: _photocore.ComparatorSolution
    variance: Floats  # (m, 2) of the means

    def __init__(
        self,
        cases: Sequence[PlacedCase],
        grids: Mapping[int, Grid],
        linear: CombinedLinear,
        grid_um: Mapping[int, float | None],
        pointing_um: tuple[float, float],
        polynomial: bool,
    ) -> None:
        self.cases, self.grid_um = cases, grid_um
        self.measured_cases = np.repeat(np.arange(len(cases)), [len(case.points) for case in cases])
        points = np.concatenate([case.points for case in cases])
        self.plates = plates = list(dict.fromkeys(case.case.plate for case in cases))
        rank = np.array([plates.index(case.case.plate) for case in cases])[self.measured_cases]
        _, first, self.measured_points = np.unique(
            rank * (points.max() + 1) + points, return_index=True, return_inverse=True
        )
        self.points, self.plate_of = points[first], np.array(plates)[rank[first]]
        own = [(grids[plate], self.points[self.plate_of == plate]) for plate in plates]
        self.grid_xy = np.vstack([grid.xy_um[grid.rows_of(some)] for grid, some in own])
        counts = np.concatenate([case.counts for case in cases])
        self.pointing = np.array(pointing_um) ** 2 / counts[:, np.newaxis]
        self.frame = frame = Frame.of(np.vstack([fit.residuals.xy_um for fit in linear.cases]))
        self.placements = [
            [fit.rotation_rad, *(rotation_matrix(fit.rotation_rad) @ frame.centre_um + fit.translation_um)]
            for fit in linear.cases
        ]
        self.coefficient_sd = [math.inf if polynomial else 0.0] * OWN_TERMS

    def solve(self, grid: Mapping[int, float], random: float) -> None:
        """Adjust with given standard deviations of grid and comparator."""
        self.variance = random**2 + self.pointing
        sd = np.array([grid[plate] for plate in self.plate_of.tolist()])
        try:
            self.solution = _photocore.adjust_comparator(
                self.grid_xy,
                np.column_stack([sd, sd]),
                np.array(self.placements),
                [case.orientation.left_handed for case in self.cases],
                self.measured_cases,
                self.measured_points,
                np.vstack([case.means_um for case in self.cases]),
                np.sqrt(self.variance),
                ([0.0] * OWN_TERMS, [0.0] * OWN_TERMS),
                (self.coefficient_sd, self.coefficient_sd),
                degree=DEGREE,
                centre=self.frame.centre_um,
                half_range=self.frame.half_range_um,
                limit=1e-5,
                max_iterations=50,
            )
        except _photocore.ComparatorError as error:
            raise AdjustmentError(phrase("comparators.joint", reason=error.args[0])) from None
        if not self.solution.converged:
            raise AdjustmentError(phrase("comparators.not-converged"))

    def random(self) -> float:
        """Estimate the comparator sd by equating weighted squares and redundancy."""
        squares = float((self.solution.residuals**2 / self.variance).sum())
        ratio = squares / float(self.solution.redundancy.sum())
        variance = ratio * float(self.variance.mean()) - float(self.pointing.mean())
        return math.sqrt(max(variance, LEAST_UM**2))

    def grid_test(self, plate: int, sigma_um: float) -> tuple[float, GlobalTest | None]:
        """Return the weighted squares of plate corrections over their redundancy, and their test.

        The squares are nearly c times chi-square with g degrees of freedom (Satterthwaite). The same mean and
        variance give c = sum r^2 / sum r, g = sum r / c.
        """
        rows = self.plate_of == plate
        corrections = self.solution.grid_xy[rows] - self.grid_xy[rows]
        redundancy = self.solution.grid_redundancy[rows]
        squares, freedom = float((corrections**2).sum()) / sigma_um**2, float(redundancy.sum())
        if freedom <= 1e-9:
            return 1.0, None
        part = float((redundancy**2).sum()) / freedom
        return squares / freedom, global_test(squares / part, freedom / part)

    def fit(self, random: float, grid: Mapping[int, float]) -> JointFit:
        """Return the last solution with its standard deviations."""
        solution, dof = self.solution, self.solution.degrees_of_freedom
        scale = solution.sum_of_squares / dof if dof > 0 else 1.0
        # Terms of degree 1 and 0 of the 21 correction parameters are zero in this frame.
        place = np.concatenate([np.arange(3 + OWN_TERMS), 3 + COUNT + np.arange(OWN_TERMS)])
        values, covariance = np.zeros(PARAMETERS), np.zeros((PARAMETERS, PARAMETERS))
        values[place] = solution.comparator
        covariance[np.ix_(place, place)] = scale * solution.comparator_cofactors
        polynomial = Polynomial(self.frame, values[3:].reshape(2, COUNT), covariance[3:, 3:] / scale)
        scale_x, scale_y, lean = values[:3].tolist()
        correction = Correction(scale_x, scale_y, lean, polynomial, covariance)
        return JointFit(
            correction=correction,
            sigma0=math.sqrt(scale),
            degrees_of_freedom=dof,
            iterations=solution.iterations,
            random_um=random,
            cases=tuple(self._case(k, correction, scale) for k in range(len(self.cases))),
            plates={plate: self._plate(plate, grid[plate], scale) for plate in self.plates},
        )

    def _case(self, k: int, correction: Correction, scale: float) -> JointCase:
        case, solution, rows = self.cases[k], self.solution, self.measured_cases == k
        rotation, *centre = solution.case_placements[k].tolist()
        matrix, observed = rotation_matrix(rotation), solution.residuals[rows]
        redundancy = solution.redundancy[rows]
        deviation = np.sqrt(scale * self.variance[rows] * redundancy)
        corrected = correction.apply(case.means_um)
        return JointCase(
            number=case.number,
            rotation_rad=rotation,
            translation_um=np.asarray(centre - matrix @ self.frame.centre_um),
            covariance=scale * solution.case_cofactors[k],
            residuals=Residuals(case.points, corrected, -observed, np.asarray(observed @ matrix.T), math.nan),
            standardized=np.divide(
                -observed, deviation, out=np.full(observed.shape, np.nan), where=redundancy > 1e-6
            ),
        )

    def _plate(self, plate: int, sigma_um: float, scale: float) -> JointPlate:
        rows, estimated = self.plate_of == plate, self.grid_um[plate] is None
        ratio, test = self.grid_test(plate, sigma_um) if sigma_um > 0 else (None, None)
        return JointPlate(
            points=self.points[rows],
            corrections_um=np.asarray(self.solution.grid_xy[rows] - self.grid_xy[rows]),
            covariance_um2=scale * self.solution.grid_cofactors[rows],
            sigma_um=sigma_um,
            estimated=estimated,
            variance_ratio=ratio,
            test=None if estimated else test,
        )
