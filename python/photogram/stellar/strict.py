"""Strict iteration with exact partials, on the common engine of all programs."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass, field
from photogram.stellar.problem import Problem, degrees_of_freedom, failure
from photogram.stellar.state import Level, Solved

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
    parameters, places = initial.copy(), problem.places_at(initial, free)
    dof = degrees_of_freedom(problem, free).usable
    unit = _EXPECTED * parameters[12] * float(np.sqrt(np.median(problem.image_weights[:, 0, 0])))
    run = _Run(problem, limit or _MAX_ITERATIONS, dof, threads or 0, progress)
    for _ in range(3):
        active = run.effective(parameters, places, free)
        found = run.settle(parameters, places, active, unit, _ROUGH)
        parameters, places = found["parameters"], found["places"]
        if (active == free).all() or found["status"] not in ("converged", "still"):
            break
    mean_error = float(np.sqrt(sum(found["sums_of_squares"]) / dof))
    rounding = _rounding(problem, parameters)
    unit = max(mean_error, rounding / _FINE)
    run.rounding = rounding / unit
    status = run.settle(parameters, places, free, unit, max(rounding / unit, _FINEST))
    last = run.adjust(status["parameters"], status["places"], free, unit, 0.0, most=_MORE, covariance=True)
    return Solved.of(
        problem,
        last,
        unit=unit,
        parameters=last["parameters"],
        free=free,
        cofactors=last.get("cofactors", np.full((len(free), len(free)), np.nan)),
        log_determinant=last.get("log_determinant", math.nan),
        stop=_STOPS.get(status["status"], f"{len(run.levels) - 1} ITERATIONS COMPLETED"),
        converged=status["status"] in ("converged", "still"),
        levels=tuple(Level(solution, i + 1, level) for i, level in enumerate(run.levels)),
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

    def settle(
        self, parameters: Floats, places: Floats, free: Bools, unit: float, fraction: float
    ) -> dict[str, Any]:
        """Adjust to small corrections, a constant sum of squares, or the iteration limit."""
        found = self.adjust(parameters, places, free, unit, fraction, most=_FIRST)
        while found["status"] != "converged":
            if self._still():
                return {**found, "status": "still"}
            if found["status"] == "diverged" or len(self.levels) > self.limit:
                break
            found = self.adjust(found["parameters"], found["places"], free, unit, fraction, most=_NEXT)
        return found

    def _still(self) -> bool:
        last = np.array(self.levels[-_NEXT:])
        if len(last) < _NEXT or not last[-1] > 0:
            return False
        sums = self.dof * (last / last[-1]) ** 2
        return bool(np.ptp(sums) <= max(_STILL, self.dof * self.rounding))

    def effective(self, parameters: Floats, places: Floats, free: Bools) -> Bools:
        """Return the free parameters with an effect or a weight at some values."""
        active = free.copy()
        try:
            active[self.problem.core(parameters, places, ~free).without_effect()] = False
        except _photocore.StellarError as error:
            raise failure(self.problem, error) from None
        return active

    def adjust(
        self,
        parameters: Floats,
        places: Floats,
        free: Bools,
        unit: float,
        fraction: float,
        *,
        most: int,
        covariance: bool = False,
    ) -> dict[str, Any]:
        core = self.problem.core(parameters, places, ~free)
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
