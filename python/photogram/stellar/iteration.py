"""Iterations of a plate: strict, and as published (NOAA TR NOS 55, sections 4 and 5).

The strict iteration has exact partials and the common engine of all programs. The iteration of the report has
approximate partials and its own stop rules. Distortion is computed at the measured image, and stars remain at
their catalogue positions while parameters are iterated. The change of refraction with direction is neglected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, field
from photogram.stellar.problem import Counts, Problem, degrees_of_freedom, failure, singular
from photogram.words import Phrase, phrase


@dataclass(frozen=True, eq=False)
class Solved:
    solution: str  # `minimum`, `maximum`, `refraction` or `combined`
    counts: Counts
    parameters: Floats  # (26,) values
    places: Floats  # (S, 2) adjusted star positions
    free: Bools  # (26,) whether parameters were estimated
    cofactors: Floats  # (26, 26) for unit weight; zero for fixed parameters
    star_cofactors: Floats  # (S, 2, 2) of the positions
    star_inverse: Floats  # (S, 2, 2) of the positions for fixed parameters: (1)^-1 of the report
    residuals: Floats  # (m, 2) computed minus measured plate coordinates, metres
    redundancy: Floats  # (m, 2) of the images
    standardized: Floats
    star_redundancy: Floats  # (S, 2) of the catalogue positions; NaN without weight
    star_standardized: Floats
    axis_residual: Floats | None  # Computed minus measured plate coordinates of the axis
    sums: tuple[float, float, float]  # Weighted sums of squares of plate, stars, parameters (with the axis)
    log_determinant: (
        float  # Natural logarithm for the reduced normal equations in the units of the parameters
    )
    stop: str  # Reason of the end of the iteration
    converged: bool  # Whether its convergence criterion was met
    # Levels of discrepancies before the corrections of each pass, metres. As published: root of the plate sum
    # of squares over the degrees of freedom, with stars at their catalogue positions. Otherwise: root of the
    # total weighted sum of squares over the degrees of freedom.
    levels: tuple[float, ...]
    remarks: tuple[Phrase, ...] = ()

    @classmethod
    def of(
        cls, problem: Problem, found: dict[str, Any], *, free: Bools, unit: float = 1.0, **others: Any
    ) -> Solved:
        """Return a result from the core values of stars and images, and other attributes.

        `unit` is the mean error of unit weight in the standardized residuals of the core.
        """
        observed = (problem.known & ~problem.held)[:, None]
        plate, stars, weighted, axis = found["sums_of_squares"]
        axis_residual = found["axis_residual"]
        # The residuals of the core are observed minus computed.
        return cls(
            counts=degrees_of_freedom(problem, free),
            free=free,
            places=found["places"],
            star_cofactors=found["place_cofactors"],
            star_inverse=found["place_inverses"],
            residuals=-found["residuals"],
            redundancy=found["image_redundancy"],
            standardized=-unit * found["image_standardized"],
            star_redundancy=np.where(observed, found["place_redundancy"], np.nan),
            star_standardized=np.where(observed, -unit * found["place_standardized"], np.nan),
            axis_residual=None if axis_residual is None else -np.array(axis_residual),
            sums=(plate, stars, weighted + axis),
            **others,
        )

    @property
    def iterations(self) -> int:
        return len(self.levels) - 1

    @property
    def log10_determinant(self) -> float:
        """Decimal logarithm of the determinant of the reduced normal equations."""
        return self.log_determinant / math.log(10)


@dataclass(frozen=True, eq=False)
class PreRun:
    points: tuple[str, ...]
    stars: tuple[str, ...]
    residuals: Floats  # (m, 2) computed minus measured, metres


_EXPECTED = 1e-6  # Initial mean error of a direction, radians
_ROUGH, _FINE, _FINEST = 1e-3, 1e-4, 1e-9
"""Largest changes in standard deviations for rough, converged and best solutions."""
_MAX_ITERATIONS, _MORE = 100, 5
_FIRST, _NEXT = 25, 8  # Iterations before the sum of squares is tested, and between tests
_STILL = 1e-6
"""Negligible change of the sum of squares, in squared mean errors of unit weight.

Its root is the distance of the unknowns from the minimum, in mean errors.
"""
_STOPS = {
    "converged": "NO UNKNOWN CHANGES BY MORE THAN 1E-4 OF ITS MEAN ERROR",
    "still": "THE SUM OF SQUARES STANDS STILL: NO CHANGE BY 1E-6 OF THE SQUARED MEAN ERROR",
    "diverged": "NO STEP LOWERS THE SUM OF SQUARES",
}


def iterate(
    problem: Problem,
    initial: Floats,
    free: Bools,
    *,
    solution: str,
    limit: int,
    threads: int | None = None,
    progress: Callable[..., None] | None = None,
) -> Solved:
    """Iterate to the least-squares solution.

    Parameters without an effect at the initial values (the centre of zero distortion) are estimated after the
    others. Weights are known up to a factor, so a first solution estimates the mean error of unit weight. A
    second one continues until its corrections are rounding errors: a billionth of the standard deviations on
    an ordinary plate. A few more iterations serve the cofactors. If a combination of parameters hardly has an
    effect (the centre of small distortion), corrections decrease slowly or not at all. Therefore, iteration
    also stops if the sum of squares is constant.

    AdjustmentError: if stars or parameters are not determined, or the initial values give no image.
    """
    found: dict[str, Any] = {"parameters": initial.copy(), "places": problem.places_at(initial, free)}
    dof = degrees_of_freedom(problem, free).usable
    unit = _EXPECTED * initial[12] * float(np.sqrt(np.median(problem.image_weights[:, 0, 0])))
    run = _Run(problem, limit or _MAX_ITERATIONS, dof, threads or 0, progress)
    for _ in range(3):
        active = run.effective(found, free)
        found = run.settle(found, active, unit, _ROUGH)
        if (active == free).all() or found["status"] not in ("converged", "still"):
            break
    mean_error = float(np.sqrt(sum(found["sums_of_squares"]) / dof))
    rounding = _rounding(problem, found["parameters"])
    unit = max(mean_error, rounding / _FINE)
    run.rounding = rounding / unit
    settled = run.settle(found, free, unit, max(rounding / unit, _FINEST))
    status, last = settled["status"], run.adjust(settled, free, unit, 0.0, _MORE, covariance=True)
    return Solved.of(
        problem,
        last,
        unit=unit,
        parameters=last["parameters"],
        free=free,
        cofactors=last.get("cofactors", np.full((len(free), len(free)), np.nan)),
        log_determinant=last.get("log_determinant", math.nan),
        stop=_STOPS.get(status, f"{len(run.levels) - 1} ITERATIONS COMPLETED"),
        converged=status in ("converged", "still"),
        levels=tuple(run.levels),
        solution=solution,
    )


def _rounding(problem: Problem, parameters: Floats) -> float:
    """Return the root of the weighted sum of squares of observation rounding errors."""
    plate = parameters[12] ** 2 * np.einsum("mii->", problem.image_weights)
    tested = problem.known & ~problem.held
    stars = np.einsum("sii,si->", problem.star_weights[tested], problem.star_places[tested] ** 2)
    weighted = np.diag(problem.parameter_weights) @ parameters**2
    return float(np.finfo(float).eps * np.sqrt(plate + stars + weighted))


@dataclass
class _Run:
    problem: Problem
    limit: int
    dof: int
    threads: int
    progress: Callable[..., None] | None
    levels: list[float] = field(default_factory=list)
    rounding: float = 0.0

    def settle(self, at: dict[str, Any], free: Bools, unit: float, fraction: float) -> dict[str, Any]:
        """Adjust to small corrections, a constant sum of squares, or the iteration limit."""
        found = self.adjust(at, free, unit, fraction, _FIRST)
        while found["status"] != "converged":
            if self._still():
                return {**found, "status": "still"}
            if found["status"] == "diverged" or len(self.levels) > self.limit:
                break
            found = self.adjust(found, free, unit, fraction, _NEXT)
        return found

    def _still(self) -> bool:
        last = np.array(self.levels[-_NEXT:])
        if len(last) < _NEXT or not last[-1] > 0:
            return False
        sums = self.dof * (last / last[-1]) ** 2
        return bool(np.ptp(sums) <= max(_STILL, self.dof * self.rounding))

    def effective(self, at: dict[str, Any], free: Bools) -> Bools:
        """Return the free parameters with an effect or a weight at some values."""
        active = free.copy()
        try:
            active[self.problem.core(at["parameters"], at["places"], ~free).without_effect()] = False
        except _photocore.StellarError as error:
            raise failure(self.problem, error) from None
        return active

    def adjust(
        self,
        at: dict[str, Any],
        free: Bools,
        unit: float,
        fraction: float,
        most: int,
        covariance: bool = False,
    ) -> dict[str, Any]:
        core = self.problem.core(at["parameters"], at["places"], ~free)
        try:
            found = core.adjust(
                unit=unit,
                fraction=fraction,
                max_iterations=min(most, self.limit - max(len(self.levels) - 1, 0)),
                covariance=covariance,
                threads=self.threads,
                progress=self.progress,
                whole=covariance,
            )
        except _photocore.StellarError as error:
            raise failure(self.problem, error) from None
        # Sums of squares of the engine are in units of the expected mean error.
        sums = [found["initial_sum_of_squares"], *(row[1] for row in found["iterations"])]
        levels = [math.sqrt(value / self.dof) * unit for value in sums]
        self.levels += levels[1:] if self.levels else levels
        if self.problem.options.common_scale:
            found["parameters"][13] = found["parameters"][12]
        return dict(found)


DIVERGED = "FOUR DIVERGENT STEPS OCCURRED"
SETTLED = "ITERATION RESULTS DIFFER BY LESS THAN TOLERANCE SETTING"
_MAX_PASSES = 6  # of the inverse of the distortion
_MAX_PUBLISHED_ITERATIONS = 100


def stop_reason(levels: Sequence[float], tolerance: float, limit: int) -> str | None:
    """Apply the three stop rules to the levels of discrepancies; None to continue.

    Each level precedes the correction of its pass. The tolerance is the difference of successive levels at
    convergence. A limit of 0 means unlimited.
    """
    if not np.isfinite(levels[-1]):
        return DIVERGED
    if len(levels) < 2:
        return None
    rises = sum(after > before for before, after in pairwise(levels))
    if rises >= 4:
        return DIVERGED
    if abs(levels[-2] - levels[-1]) <= tolerance:
        return SETTLED
    limit = limit or _MAX_PUBLISHED_ITERATIONS
    return f"{limit} ITERATIONS COMPLETED" if len(levels) > limit else None


def _tolerances(problem: Problem) -> dict[str, Any]:
    options = problem.options
    return {
        "refraction": options.refraction_tolerance,
        "distortion": options.distortion_tolerance,
        "passes": _MAX_PASSES,
    }


def iterate_as_published(
    problem: Problem, initial: Floats, free: Bools, *, solution: str, limit: int, once: bool = False
) -> Solved:
    """Iterate from initial parameters (26,) to the solution of the report.

    A limit of 0 means unlimited; `once` corrects once without a test, as in the report for refraction.

    AdjustmentError: if a star or the parameters are not determined (errors 2 and 4).
    """
    parameters, dof = initial.copy(), degrees_of_freedom(problem, free).usable
    known = problem.known[problem.image_stars]
    levels: list[float] = []
    correction: dict[str, Any] = {}
    limit = 1 if once else limit
    while True:
        core = problem.core(parameters, problem.places_at(parameters, free), ~free)
        constant = core.published(**_tolerances(problem))["constant"]
        # Squares may overflow after divergence.
        with np.errstate(over="ignore"):
            levels.append(float(np.sqrt(np.sum(constant[known] ** 2) / dof)))
        stop = stop_reason(levels, 0.0 if once else problem.options.tolerance, limit)
        if stop:
            break
        # Parameters without an effect yet (a direction of zero decentring) are not corrected.
        correction = _correction(problem, core)
        parameters = parameters + correction["parameters"]
        if abs(parameters[21]) > 2 * np.pi:
            parameters[21] = np.mod(parameters[21], 2 * np.pi)
        if problem.options.common_scale:
            parameters[13] = parameters[12]
    if not correction:
        # The equations name invisible stars, unless the camera makes all of them invisible.
        if np.isfinite(constant).any():
            _correction(problem, core)
        raise AdjustmentError(phrase("stars.initial-camera"))
    if correction["without_effect"]:
        raise singular(correction["without_effect"])
    # Covariance and determinant belong to the last correction; later equations are used for the residuals.
    return residual_cycle(
        problem,
        parameters,
        free,
        cofactors=correction["cofactors"],
        log_determinant=correction["log_determinant"],
        stop=stop,
        converged=stop == SETTLED or once,
        levels=tuple(levels),
        solution=solution,
    )


def _correction(problem: Problem, core: _photocore.StellarProblem) -> dict[str, Any]:
    try:
        return core.correction(**_tolerances(problem))
    except _photocore.StellarError as error:
        raise failure(problem, error) from None


def residual_cycle(
    problem: Problem, parameters: Floats, free: Bools, *, cofactors: Floats, **others: Any
) -> Solved:
    """Compute star corrections, residuals and tests at final parameters (v-cycle).

    Refraction refers to the corrected positions. The listing of the report uses catalogue positions, a
    difference of two millionths of the mean error of unit weight. `cofactors` (26, 26) refer to the
    parameters, `others` are further attributes of the solution.

    AdjustmentError: if a star is not determined by its images (error 2), or is not imaged with these
    parameters.
    """
    tolerances = _tolerances(problem)
    core = problem.core(parameters, problem.places_at(parameters, free), ~free)
    try:
        found = core.residual_cycle(np.ascontiguousarray(cofactors), **tolerances)
    except _photocore.StellarError as error:
        raise failure(problem, error) from None
    final = problem.core(parameters, found["places"], ~free).published(**tolerances)
    remarks = tuple(
        phrase("stars.unsettled-distortion", point=problem.image_points[i], first=a, second=b)
        for i, (a, b) in final["unsettled"]
    )
    return Solved.of(
        problem, found, parameters=parameters, free=free, cofactors=cofactors, remarks=remarks, **others
    )
