"""Perspective centre of a projector from a grid (USGS CC 2, 1969).

Plate coordinates are the observations. Mean model coordinates are assumed to be errorless, as in the report.
The covariance and the test values follow from the residuals of the adjustment. `docs/perspective-center.md`
contains the formulae.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.adjustment.remarks import hidden
from photogram.adjustment.resection import Observed, solve
from photogram.arguments.arrays import one_of, shaped, truth_value
from photogram.arguments.types import Floats
from photogram.errors import AdjustmentError, InputError, RankError, message_of
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.network.geometry import rotation_matrix
from photogram.perspective_center.grid import MINUTES_PER_RADIAN, Grid, single
from photogram.show.methods import Judged
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.limits import externally_studentized, studentized_limit
from photogram.statistics.reliability import ROUNDING, TESTABLE
from photogram.summaries import Brief
from photogram.words import Phrase, phrase

Weights = Literal["equal", "readings", "deviations"]

MOST_CYCLES = 6  # Maximum number of cycles of the program
STRICT_CYCLES = 50
STRICT_FRACTION = 1e-9
"""Convergence limit, in standard deviations of the unknowns for a unit weight of one millimetre."""
SINGULAR = "NORMAL EQUATIONS MATRIX IS SINGULAR"
NOT_CONVERGED = "SORRY - SOLUTION DOES NOT CONVERGE"
REPORT_ORDER = [3, 4, 5, 0, 1, 2]  # Omega, phi, kappa before X, Y, Z
INTERIOR = ("c", "xp", "yp")  # Principal distance and principal point
STEEPEST = 1e-10  # Ratio of singular values of scaled columns below which they are dependent


@dataclass(frozen=True, eq=False)
class Cycle:
    """One iteration cycle: position, correction, and angles after it in minutes."""

    position: Floats
    correction: Floats
    attitude_minutes: Floats


@dataclass(frozen=True, eq=False, repr=False)
class PerspectiveCenter(Judged, Brief):
    """Perspective centre and attitude of a projector, with quality, from n points.

    Lengths in the model are in its unit, on the plate in millimetres; angles are omega, phi, kappa.

    Attributes
    ----------
    grid
        The measured grid.
    as_published
        True for the algorithm of the program.
    converged
        True if the convergence criterion was met.
    cycles
        The iteration.
    position, attitude
        (3,) Xc, Yc, Zc; (3,) in radians.
    interior
        (3,) principal distance and principal point on the plate, millimetres, given or estimated.
    unknown
        The k estimated parameters among `c`, `xp`, `yp`.
    cofactors
        (6 + k, 6 + k) cofactors of omega, phi, kappa, Xc, Yc, Zc and `unknown` for a unit weight of one
        millimetre on the plate.
    sigma0_plate, sigma0_model
        Standard error of unit weight of plate coordinates (mm) and of projected coordinates in the model (its
        unit); None without redundancy.
    degrees_of_freedom
        2 n - 6 - k.
    weights
        (n,) weights of the points, 1 in the mean.
    residual, projected
        (n, 2) measured minus projected, and projected coordinates, in the model.
    observed_radius, fixed_radius, radial_distortion
        (n,) radii on the plate of the transformed measured point and of the grid point, and their difference,
        positive outward.
    redundancy, standardized
        (n, 2) redundancy numbers of the residuals in X and Y, and residuals over their own standard
        deviations from `sigma0_plate`; NaN without redundancy. The latter never exceed the root of the
        degrees of freedom.
    studentized
        (n, 2) the same with the standard error of unit weight of all other coordinates: Student with 2 n - 7
        degrees of freedom, unbounded. NaN with less than two degrees of freedom.
    messages
        Warnings on the solution.
    """

    grid: Grid
    as_published: bool
    converged: bool
    cycles: list[Cycle]
    position: Floats
    attitude: Floats
    interior: Floats
    unknown: tuple[str, ...]
    cofactors: Floats
    sigma0_plate: float | None
    sigma0_model: float | None
    degrees_of_freedom: int
    weights: Floats
    residual: Floats
    projected: Floats
    observed_radius: Floats
    fixed_radius: Floats
    radial_distortion: Floats
    redundancy: Floats
    standardized: Floats
    studentized: Floats
    messages: list[Message]

    @property
    def attitude_minutes(self) -> Floats:
        """(3,) omega, phi, kappa in minutes."""
        return self.attitude * MINUTES_PER_RADIAN

    @property
    def limit(self) -> float:
        """Critical value that good readings exceed in one of twenty sets (Bonferroni)."""
        return studentized_limit(self.degrees_of_freedom, int(np.isfinite(self.studentized).sum()))

    @property
    def outliers(self) -> list[tuple[int, int]]:
        """Row and axis (0 X, 1 Y) of the residuals beyond the limit, the largest first."""
        values = np.abs(np.nan_to_num(self.studentized))
        beyond = np.argwhere(values > self.limit).tolist()
        return sorted(((row, axis) for row, axis in beyond), key=lambda place: -values[place])

    @property
    def covariance(self) -> Floats | None:
        """(6 + k, 6 + k) covariance of omega, phi, kappa (rad), Xc, Yc, Zc ...; None without redundancy."""
        return None if self.sigma0_plate is None else self.cofactors * self.sigma0_plate**2

    @property
    def standard_errors(self) -> Floats | None:
        """(6,) standard errors of Xc, Yc, Zc, then omega, phi, kappa in minutes; None without redundancy."""
        if self.covariance is None:
            return None
        deviations = np.sqrt(np.diagonal(self.covariance))
        errors: Floats = np.concatenate([deviations[3:6], deviations[:3] * MINUTES_PER_RADIAN])
        return errors

    @property
    def interior_errors(self) -> Floats | None:
        """(k,) standard errors of the estimated interior parameters, mm; None without redundancy."""
        return None if self.covariance is None else np.sqrt(np.diagonal(self.covariance)[6:])

    def _findings(self) -> Findings:
        """Return tests of residuals by t, because standard deviations are not given."""
        freedom, status = self.degrees_of_freedom, "converged" if self.converged else "not converged"
        values = np.where(self.redundancy >= TESTABLE, self.studentized, np.nan)
        names = [[f"{axis} of point {name}" for axis in "XY"] for name in self.grid.ids]
        kind, second = "readings of the grid", max(freedom - 1, 1)
        tests = [Tested(kind, values, lambda at: names[at[0]][at[1]], "t", second=second)]
        why = Phrase("untested.sd")
        return Findings(status=status, observations=tests, degrees_of_freedom=freedom, untested=why)


def determine(
    grid: Grid,
    *,
    as_published: bool = False,
    weights: Weights = "equal",
    model_sd: ArrayLike | None = None,
    unknown: Sequence[str] = (),
) -> PerspectiveCenter:
    """Determine the perspective centre and the attitude of a projector.

    Parameters
    ----------
    grid
        The projected grid.
    as_published
        True to iterate, and form residuals, like the program. It uses at most six cycles, until the
        correction of the position is shorter than the tolerance. Coefficients contain observed instead of
        computed plate coordinates, residuals include the last correction, and one scale is used, of the last
        point. False for strictly converged least squares, from a direct solution if the approximations fail,
        with residuals by projection onto the height of each point.
    weights
        `equal` as in the report; `readings`: the weight of a mean is its number of readings; `deviations`:
        its weight is the reciprocal variance of the mean, from its own readings in X and Y together.
    model_sd
        (n,) standard deviations of the mean model coordinates; their reciprocal squares replace `weights`.
    unknown
        Additional unknowns among principal distance and principal point, `c`, `xp`, `yp`. One height hardly
        determines them, because a level grid gives one scale for c and the height of the projector together.
        Points at several heights do (:func:`joined`).

    Raises
    ------
    RankError
        If the points do not determine the projector: the program's NORMAL EQUATIONS MATRIX IS SINGULAR.
    AdjustmentError
        If the approximations result in coordinates that are not finite.
    InputError
        If weights cannot be computed.
    """
    truth_value("as_published", as_published)
    # Weights of the points with mean 1
    one_of("weights", weights, get_args(Weights))
    if model_sd is not None:
        variance = shaped("model_sd", model_sd, (len(grid.ids),)) ** 2
    elif weights == "deviations":
        variance = (grid.reading_sd**2).mean(axis=1) / grid.readings
    else:
        variance = 1.0 / (grid.readings if weights == "readings" else np.ones(len(grid.ids)))
    bad = np.flatnonzero(~((variance > 0) & np.isfinite(variance)))
    if bad.size:
        names = [str(grid.ids[index]) for index in bad.tolist()]
        raise InputError(phrase("projector.no-weight", names=names))
    weight: Floats = 1.0 / variance
    weight /= weight.mean()
    unknown = tuple(dict.fromkeys(unknown))
    for name in unknown:
        one_of("unknown", name, INTERIOR)
    if unknown and as_published:
        raise InputError(phrase("projector.published-interior"))
    try:
        if unknown:
            solution = _calibrated(grid, weight, unknown)
        else:
            solution = (_as_published if as_published else _strictly)(grid, weight)
    except RankError as error:
        raise RankError(phrase("projector.singular", error=message_of(error)), [], error.points) from None
    return _result(grid, weight, solution, unknown, as_published=as_published)


def _observed(grid: Grid, weight: Floats) -> Observed:
    return Observed(
        grid.model, 0.0, grid.plate_xy, np.repeat(weight[:, np.newaxis] ** -0.5, 2, axis=1),
        -grid.principal_distance, [str(each) for each in grid.ids],
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Solution:
    """A solution of the pose, and of the k unknowns of the interior."""

    grid: Grid  # With the interior of the solution
    core: _photocore.ResectionSolution  # Last solution of the core: degrees of freedom, points behind
    # (c + 1, 6) poses of c cycles, the start first, and (c, 6) corrections: X, Y, Z, angles in radians
    history: Floats
    corrections: Floats
    residuals: Floats  # (n, 2) given minus computed plate coordinates
    partials: Floats  # (n, 2, 6 + k)
    cofactors: Floats
    converged: bool  # Whether the convergence criterion was met
    messages: list[Message]


def _strictly(grid: Grid, weight: Floats) -> _Solution:
    """Adjust to strict convergence, from a direct solution if the approximations fail."""
    starts = [grid.initial] if grid.initial is not None else []
    observed, messages = _observed(grid, weight), []
    for start in [*starts, None]:
        try:
            core = solve(observed, start=start, limit=STRICT_FRACTION, max_iterations=STRICT_CYCLES)
        except AdjustmentError:
            if start is None:
                raise
        else:
            if start is None or (core.status == "converged" and not core.points_behind.size):
                break
        messages = [Message.of("projector.direct-start")]
    history: Floats = np.vstack([core.start, core.history])
    states = history, np.diff(history, axis=0), core.residuals, core.partials, core.cofactors
    return _Solution(grid, core, *states, core.status == "converged", messages)


def _as_published(grid: Grid, weight: Floats) -> _Solution:
    if grid.initial is None:
        raise InputError(phrase("projector.no-approximations"))
    observed = _observed(grid, weight)
    # Parameters are REAL*4 words, angles in minutes: truncated digits return as a last correction.
    units = np.array([1.0, 1.0, 1.0, *[MINUTES_PER_RADIAN] * 3])
    history: list[Floats] = [single(grid.initial * units) / units]
    corrections: list[Floats] = []
    converged = False
    step = partial(solve, criterion="position", limit=grid.tolerance, max_iterations=1, at_measured=True)
    while not converged and len(corrections) < MOST_CYCLES:
        core = step(observed, start=history[-1])
        if core.status == "diverged":
            raise RankError(phrase("projector.diverged"), [], observed.names)
        corrections.append(core.pose - history[-1])
        history.append(single(core.pose * units) / units)
        converged = bool(np.linalg.norm(corrections[-1][:3]) < grid.tolerance)
    residuals: Floats = core.residuals + core.partials @ (core.pose - history[-1])
    states = np.array(history), np.array(corrections), residuals, core.partials, core.cofactors
    return _Solution(grid, core, *states, converged, [])


def _calibrated(grid: Grid, weight: Floats, unknown: tuple[str, ...]) -> _Solution:
    """Estimate pose and interior together; the pose is solved again for each interior."""
    chosen = [INTERIOR.index(name) for name in unknown]
    interior = np.array([grid.principal_distance, 0.0, 0.0])
    own = grid
    root = np.sqrt(weight)[:, np.newaxis]
    for _ in range(STRICT_CYCLES):
        solution = _strictly(own, weight)
        of_c = (own.plate_xy - solution.residuals) / own.principal_distance
        of_point = np.broadcast_to(np.eye(2), (len(grid.ids), 2, 2))
        columns = np.concatenate([of_c[:, :, np.newaxis], of_point], axis=2)[:, :, chosen]
        partials: Floats = np.concatenate([solution.partials, columns], axis=2)
        rows = (partials * root[:, :, np.newaxis]).reshape(-1, 6 + len(chosen))
        scale = np.linalg.norm(rows, axis=0)
        _, sizes, turn = np.linalg.svd(rows / scale, full_matrices=False)
        if len(rows) < len(scale) or sizes[-1] < STEEPEST * sizes[0]:
            raise _open(unknown, grid)
        cofactors: Floats = (turn.T / sizes**2) @ turn / np.outer(scale, scale)
        step = (cofactors @ rows.T @ (solution.residuals * root).ravel())[6:]
        if (np.abs(step) <= STRICT_FRACTION * np.sqrt(np.diagonal(cofactors)[6:])).all():
            return replace(solution, partials=partials, cofactors=cofactors)
        interior[chosen] += step
        if not 0.5 < interior[0] / grid.principal_distance < 2.0:
            raise _open(unknown, grid)
        own = replace(grid, plate_xy=grid.plate_xy - interior[1:], principal_distance=float(interior[0]))
    raise AdjustmentError(phrase("projector.not-converged", names=unknown, n=STRICT_CYCLES))


def _open(unknown: tuple[str, ...], grid: Grid) -> RankError:
    heights = len(np.unique(grid.model[:, 2]))
    text = phrase("projector.undetermined", n=heights, names=unknown)
    return RankError(text, [], [str(point) for point in grid.ids])


def _result(
    grid: Grid, weight: Floats, solution: _Solution, unknown: tuple[str, ...], *, as_published: bool
) -> PerspectiveCenter:
    own, core, messages = solution.grid, solution.core, solution.messages
    history, corrections, cofactors = solution.history, solution.corrections, solution.cofactors
    position, attitude = history[-1, :3], history[-1, 3:]
    if as_published:
        # v = A d - L with the last correction d, although it has been applied already (specification, 3.2).
        on_plate = np.einsum("nij,j->ni", solution.partials, corrections[-1]) - solution.residuals
        scale = (grid.model[-1, 2] - position[2]) / -grid.principal_distance
        to_model = np.tile(scale * np.eye(2), (len(grid.ids), 1, 1))
        residual = scale * on_plate
    else:
        on_plate = -solution.residuals
        projected, to_model = _projection(own, position, attitude)
        residual = grid.model[:, :2] - projected
    freedom = core.degrees_of_freedom - len(unknown)
    order = [*REPORT_ORDER, *range(6, len(cofactors))]
    sigma0, sigma0_model = (
        math.sqrt(float((weight[:, np.newaxis] * v**2).sum() / freedom)) if freedom > 0 else None
        for v in (on_plate, residual)
    )
    redundancy, reduced = _tests(solution, weight, to_model, residual)
    standardized = reduced / (sigma0 or math.nan)
    squares = float((weight[:, np.newaxis] * on_plate**2).sum())
    observed_radius = np.hypot(*(own.plate_xy - solution.residuals).T)
    fixed_radius = np.hypot(*own.plate_xy.T)
    result = PerspectiveCenter(
        grid=grid,
        as_published=as_published,
        converged=solution.converged,
        cycles=[
            Cycle(values[:3], correction[:3], values[3:] * MINUTES_PER_RADIAN)
            for values, correction in zip(history[1:], corrections, strict=True)
        ],
        position=position,
        attitude=attitude,
        interior=np.array([own.principal_distance, *(grid.plate_xy - own.plate_xy)[0]]),
        unknown=unknown,
        cofactors=cofactors[np.ix_(order, order)],
        sigma0_plate=sigma0,
        sigma0_model=sigma0_model,
        degrees_of_freedom=freedom,
        weights=weight,
        residual=residual,
        projected=grid.model[:, :2] - residual,
        observed_radius=observed_radius,
        fixed_radius=fixed_radius,
        radial_distortion=observed_radius - fixed_radius,
        redundancy=redundancy,
        standardized=standardized,
        studentized=externally_studentized(reduced, squares, freedom),
        messages=messages,
    )
    behind = [str(grid.ids[point]) for point in core.points_behind]
    messages += hidden(len(behind), behind, [])
    if result.outliers:
        names = [
            phrase(
                "projector.reading",
                point=grid.ids[row],
                axis="XY"[axis],
                t=float(result.studentized[row, axis]),
                residual=float(result.residual[row, axis]),
            )
            for row, axis in result.outliers
        ]
        place = {"title": grid.title, "set": grid.number}
        messages.append(Message.of("projector.outliers", **place, limit=result.limit, names=names))
    return result


def _projection(grid: Grid, position: Floats, attitude: Floats) -> tuple[Floats, Floats]:
    """Project the plate points onto the heights of the model points.

    The ray of (x, y, -c) has the direction e = M^T (x, y, -c). It reaches the height Z at X = Xc + t e, with
    t = (Z - Zc) / e_Z.
    """
    to_photo = rotation_matrix(attitude[np.newaxis])[0]
    plate = np.column_stack([grid.plate_xy, np.full(len(grid.ids), -grid.principal_distance)])
    direction = plate @ to_photo
    reach = (grid.model[:, 2] - position[2]) / direction[:, 2]
    slope = direction[:, :2] / direction[:, 2:]
    projected = position[:2] + reach[:, np.newaxis] * direction[:, :2]
    across = to_photo[:2, :2].T - slope[:, :, np.newaxis] * to_photo[:2, 2]
    return projected, reach[:, np.newaxis, np.newaxis] * across


def _tests(solution: _Solution, weight: Floats, to_model: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """Return redundancy numbers, and standardized residuals in the model.

    The residuals on the plate have the cofactors P^-1 - A Q A^T. After transformation of P^-1 and of the
    cofactors to the model, the quotient of their diagonals is the visible part of an error of X or Y.
    """
    observed, partials = np.eye(2) / weight[:, np.newaxis, np.newaxis], solution.partials
    residuals = observed - partials @ solution.cofactors @ partials.transpose(0, 2, 1)
    turned = [to_model @ each @ to_model.transpose(0, 2, 1) for each in (residuals, observed)]
    of_residuals, of_observed = (np.diagonal(each, axis1=1, axis2=2) for each in turned)
    redundancy: Floats = of_residuals / of_observed
    return redundancy, residual / np.sqrt(np.where(redundancy > ROUNDING, of_residuals, np.nan))
