"""Iteration of the report: approximate partials and stop rules (NOAA TR NOS 55, sections 4 and 5).

In contrast to the strict iteration, distortion is computed at the measured image, and stars remain at their
catalogue positions while parameters are iterated. The change of refraction with direction is neglected.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError
from photogram.stellar.problem import Problem, degrees_of_freedom, failure, singular
from photogram.stellar.state import Level, Solved
from photogram.words import phrase

DIVERGED = "FOUR DIVERGENT STEPS OCCURRED"
SETTLED = "ITERATION RESULTS DIFFER BY LESS THAN TOLERANCE SETTING"
_MAX_PASSES = 6  # of the inverse of the distortion
_MAX_ITERATIONS = 100


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
    limit = limit or _MAX_ITERATIONS
    return f"{limit} ITERATIONS COMPLETED" if len(levels) > limit else None


def _tolerances(problem: Problem) -> dict[str, Any]:
    options = problem.options
    return {
        "refraction": options.refraction_tolerance,
        "distortion": options.distortion_tolerance,
        "passes": _MAX_PASSES,
    }


def iterate(
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
        levels=tuple(Level(solution, i + 1, level) for i, level in enumerate(levels)),
    )


def _correction(problem: Problem, core: _photocore.StellarProblem) -> dict[str, Any]:
    """Return the correction at core values; raise errors with names."""
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
