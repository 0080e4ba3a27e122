"""The report's own iteration: its approximate partials and its stop rules (NOAA TR NOS 55, sections 4 and 5).

It differs from the strict one in that distortion is taken at the measured image, stars stay at their
catalogue places while the parameters are iterated, and the change of refraction with direction is neglected.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.stellar.counts import degrees_of_freedom
from photogram.stellar.parameters import NAMES
from photogram.stellar.problem import Problem
from photogram.stellar.reduction import Reduced, invert, log_determinant, reduce, singular
from photogram.stellar.residuals import complete
from photogram.stellar.state import Level, Solved

__all__ = ["DIVERGED", "SETTLED", "iterate", "residual_cycle", "stop_reason"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

DIVERGED = "FOUR DIVERGENT STEPS OCCURRED"
SETTLED = "ITERATION RESULTS DIFFER BY LESS THAN TOLERANCE SETTING"
PASSES = 6
"""Passes of the inverse of the distortion at the most."""
_MOST = 100


def stop_reason(levels: Sequence[float], tolerance: float, limit: int) -> str | None:
    """Apply the three stop rules to the levels of discrepancies so far; None to go on.

    Parameters
    ----------
    levels
        Of every pass, before its correction.
    tolerance
        Largest difference of two successive levels at which the iteration has settled.
    limit
        Iterations at the most; 0 for none.
    """
    if len(levels) < 2:
        return None
    rises = sum(after > before for before, after in pairwise(levels))
    if rises >= 4:
        return DIVERGED
    if abs(levels[-2] - levels[-1]) <= tolerance:
        return SETTLED
    limit = limit or _MOST
    return f"{limit} ITERATIONS COMPLETED" if len(levels) > limit else None


@dataclass(frozen=True, eq=False)
class _Formed:
    """Equations at some values."""

    equations: dict[str, Any]
    reduced: Reduced
    places: Floats


def _form(problem: Problem, parameters: Floats, free: Bools) -> _Formed:
    """Form the equations; directions that are not known come from their first images."""
    places = problem.star_places.copy()
    unknown = ~problem.known
    if unknown.any():
        directions = problem.core(parameters, places, ~free).directions()
        stars, first = np.unique(problem.image_stars, return_index=True)
        seen = unknown[stars]
        places[stars[seen]] = directions[first[seen]]
    core = problem.core(parameters, places, ~free)
    equations = _published(problem, core)
    return _Formed(equations, reduce(problem, core, equations, places), places)


def _published(problem: Problem, core: Any) -> dict[str, Any]:
    options = problem.options
    found: dict[str, Any] = core.published(
        refraction=options.refraction_tolerance,
        distortion=options.distortion_tolerance,
        passes=PASSES,
    )
    return found


def iterate(
    problem: Problem, initial: Floats, free: Bools, *, solution: str, limit: int, once: bool = False
) -> Solved:
    """Iterate to the report's solution.

    Parameters
    ----------
    problem
        The problem.
    initial
        (26,) initial parameters.
    free
        (26,) which of them to estimate.
    solution
        `minimum`, `maximum` or `refraction`.
    limit
        Iterations at the most; 0 for none.
    once
        Correct once without a test, as the report does for refraction.

    Raises
    ------
    AdjustmentError
        A star or the parameters are not determined (errors 2 and 4).
    """
    parameters, dof = initial.copy(), degrees_of_freedom(problem, free).usable
    weights = problem.parameter_weights
    levels: list[float] = []
    inverse, determinant, touched = None, math.nan, free
    while True:
        formed = _form(problem, parameters, free)
        known = problem.known[problem.image_stars]
        levels.append(float(np.sqrt(np.sum(formed.equations["constant"][known] ** 2) / dof)))
        limit_now = 1 if once else limit
        stop = stop_reason(levels, 0.0 if once else problem.options.tolerance, limit_now)
        if stop:
            break
        normal = formed.reduced.normal + weights
        right = formed.reduced.right - weights @ (parameters - problem.initial)
        # What the equations do not touch yet (a direction of no decentering) is not corrected.
        touched = free & (np.diag(normal) > 0)
        inverse, determinant = invert(normal, touched), log_determinant(normal, touched)
        parameters = parameters + inverse @ right
        parameters[21] = (
            np.mod(parameters[21], 2 * np.pi) if abs(parameters[21]) > 2 * np.pi else parameters[21]
        )
        if problem.options.common_scale:
            parameters[13] = parameters[12]
    if (free & ~touched).any():
        raise singular([NAMES[i] for i in np.flatnonzero(free & ~touched)])
    history = tuple(Level(solution, i + 1, level) for i, level in enumerate(levels))
    # Covariance and determinant are those of the last correction; the equations after it serve the residuals.
    solved = residual_cycle(problem, parameters, free, cofactors=inverse, formed=formed)
    return replace(
        solved,
        stop=stop,
        converged=stop == SETTLED or once,
        levels=history,
        log_determinant=determinant,
    )


def residual_cycle(
    problem: Problem,
    parameters: Floats,
    free: Bools,
    *,
    cofactors: Floats | None = None,
    formed: _Formed | None = None,
) -> Solved:
    """Compute star corrections, residuals and their tests at final parameters (the report's v-cycle).

    Refraction is that of the corrected places; the report's listing keeps that of the catalogue's, which is
    two millionths of the mean error of unit weight.

    Parameters
    ----------
    problem, parameters, free
        As for `iterate`.
    cofactors
        (26, 26) of the parameters, where they do not come from the equations themselves.
    formed
        The equations at these parameters, where they are there already.
    """
    formed = formed or _form(problem, parameters, free)
    reduced = formed.reduced
    if cofactors is None:
        cofactors = invert(reduced.normal + problem.parameter_weights, free)
    corrections = reduced.star_corrections()
    core = problem.core(parameters, formed.places + corrections, ~free)
    final = _published(problem, core)
    remarks = tuple(
        f"DISTORTION NOT CONVERGING FOR POINT NUMBER {problem.image_points[i]}: "
        f"last changes {a:.3g}, {b:.3g} m"
        for i, (a, b) in final["unsettled"]
    )
    return complete(
        problem,
        core,
        reduced,
        parameters=parameters,
        free=free,
        places=formed.places + corrections,
        residuals=-final["constant"],
        cofactors=cofactors,
        remarks=remarks,
    )
