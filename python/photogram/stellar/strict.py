"""The strict iteration: exact partials, on the engine that serves all programs."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.stellar.problem import Problem, degrees_of_freedom, failure
from photogram.stellar.state import Level, Solved

_EXPECTED = 1e-6
"""Mean error of a direction to begin with, radians."""
_ROUGH, _FINE, _FINEST = 1e-3, 1e-4, 1e-9
"""Largest changes in standard deviations: of a first solution, of one that has converged, of the best."""
_LIMIT, _MORE = 100, 5
_FIRST, _NEXT = 25, 8
"""Iterations after which the sum of squares is looked at, and again and again."""
_STILL = 1e-6
"""Change of the sum of squares, in units of the squared mean error of unit weight, that is none: its root is
how far unknowns are from the smallest sum, in mean errors."""


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

    Parameters that the initial values leave without effect (the centre of a distortion that is zero) join in
    once the others have given them one. Weights are only known up to a factor, so a first solution finds the
    mean error of unit weight. A second one goes on until its corrections are rounding errors, a billionth of
    the standard deviations on an ordinary plate; then a few more, so that the cofactors hold at the solution.
    Where some combination of parameters hardly has an effect (the centre of a small distortion), corrections
    fall slowly or not at all: the iteration stops, too, when the sum of squares stands still.

    Raises AdjustmentError: stars or parameters are not determined, or the initial values give no image.
    """
    parameters, places = initial.copy(), problem.places_at(initial, free)
    dof = degrees_of_freedom(problem, free).usable
    unit = _EXPECTED * parameters[12] * float(np.sqrt(np.median(problem.image_weights[:, 0, 0])))
    run = _Run(problem, solution, limit or _LIMIT, dof, threads or 0, progress)
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
    found = run.settle(parameters, places, free, unit, max(rounding / unit, _FINEST))
    last = run.adjust(found["parameters"], found["places"], free, unit, 0.0, most=_MORE, covariance=True)
    return run.solved({**last, "status": found["status"]}, free, unit)


def _rounding(problem: Problem, parameters: Floats) -> float:
    """Return the root of the weighted sum of squares of what rounding alone may leave of all observations."""
    plate = parameters[12] ** 2 * np.einsum("mii->", problem.image_weights)
    tested = problem.known & ~problem.held
    stars = np.einsum("sii,si->", problem.star_weights[tested], problem.star_places[tested] ** 2)
    weighted = np.diag(problem.parameter_weights) @ parameters**2
    return float(np.finfo(float).eps * np.sqrt(plate + stars + weighted))


class _Run:
    """A problem, its history, and how the engine is called."""

    def __init__(
        self,
        problem: Problem,
        solution: str,
        limit: int,
        dof: int,
        threads: int,
        progress: Callable[..., None] | None,
    ) -> None:
        self.problem, self.solution, self.limit = problem, solution, limit
        self.dof, self.threads, self.progress = dof, threads, progress
        self.levels: list[float] = []
        self.rounding = 0.0

    def settle(
        self, parameters: Floats, places: Floats, free: Bools, unit: float, fraction: float
    ) -> dict[str, Any]:
        """Adjust until corrections are small, the sum of squares stands still, or the limit is reached."""
        found = self.adjust(parameters, places, free, unit, fraction, most=_FIRST)
        while found["status"] != "converged":
            if self._still():
                return {**found, "status": "still"}
            if found["status"] == "diverged" or len(self.levels) > self.limit:
                break
            found = self.adjust(found["parameters"], found["places"], free, unit, fraction, most=_NEXT)
        return found

    def _still(self) -> bool:
        """Say whether the last sums of squares are equal, but for what is no change and for rounding."""
        last = np.array(self.levels[-_NEXT:])
        if len(last) < _NEXT or not last[-1] > 0:
            return False
        sums = self.dof * (last / last[-1]) ** 2
        return bool(np.ptp(sums) <= max(_STILL, self.dof * self.rounding))

    def effective(self, parameters: Floats, places: Floats, free: Bools) -> Bools:
        """Find the free parameters that have an effect at some values, or a weight."""
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
        most: int = _LIMIT,
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
        # A sum of squares of the engine counts in units of the expected mean error.
        sums = [found["initial_sum_of_squares"], *(row[1] for row in found["iterations"])]
        levels = [math.sqrt(value / self.dof) * unit for value in sums]
        self.levels += levels[1:] if self.levels else levels
        if self.problem.options.common_scale:
            found["parameters"][13] = found["parameters"][12]
        return dict(found)

    def solved(self, found: dict[str, Any], free: Bools, unit: float) -> Solved:
        status, count = found["status"], len(self.levels) - 1
        stops = {
            "converged": "NO UNKNOWN CHANGES BY MORE THAN 1E-4 OF ITS MEAN ERROR",
            "still": "THE SUM OF SQUARES STANDS STILL: NO CHANGE BY 1E-6 OF THE SQUARED MEAN ERROR",
            "diverged": "NO STEP LOWERS THE SUM OF SQUARES",
        }
        return Solved.of(
            self.problem,
            found,
            unit=unit,
            parameters=found["parameters"],
            free=free,
            cofactors=found.get("cofactors", np.full((len(free), len(free)), np.nan)),
            log_determinant=found.get("log_determinant", math.nan),
            stop=stops.get(status, f"{count} ITERATIONS COMPLETED"),
            converged=status in ("converged", "still"),
            levels=tuple(Level(self.solution, i + 1, level) for i, level in enumerate(self.levels)),
        )
