"""The strict iteration: exact partials, on the engine that serves all programs."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.errors import AdjustmentError
from photogram.stellar.counts import degrees_of_freedom
from photogram.stellar.parameters import NAMES
from photogram.stellar.problem import Problem
from photogram.stellar.reduction import log_determinant, reduce, singular, undetermined
from photogram.stellar.residuals import complete
from photogram.stellar.state import Level, Solved

__all__ = ["iterate", "residual_cycle"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

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

    Raises
    ------
    AdjustmentError
        Stars or parameters are not determined, or the initial values give no image.
    """
    parameters, places = initial.copy(), _first_places(problem, initial, free)
    dof = degrees_of_freedom(problem, free).usable
    unit = _EXPECTED * parameters[12] * float(np.sqrt(np.median(problem.image_weights[:, 0, 0])))
    run = _Run(problem, solution, limit or _LIMIT, dof, threads or 0, progress)
    for _ in range(3):
        active = free & run.effective(parameters, places, free)
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


def _first_places(problem: Problem, parameters: Floats, free: Bools) -> Floats:
    places = problem.star_places.copy()
    unknown = ~problem.known
    if unknown.any():
        directions = problem.core(parameters, places, ~free).directions()
        first = {int(star): i for i, star in reversed(list(enumerate(problem.image_stars)))}
        for star in np.flatnonzero(unknown):
            places[star] = directions[first[int(star)]]
    return places


def residual_cycle(
    problem: Problem, parameters: Floats, free: Bools, places: Floats, *, cofactors: Floats
) -> Solved:
    """Compute star corrections, residuals and their tests at final parameters, without iterating again.

    Parameters
    ----------
    problem, parameters, free
        As for `iterate`.
    places
        (S, 2) places near the final ones.
    cofactors
        (26, 26) of the parameters.
    """
    core = problem.core(parameters, places, ~free)
    reduced = reduce(problem, core, core.equations(), places)
    places = places + reduced.star_corrections()
    final = problem.core(parameters, places, ~free)
    return complete(
        problem,
        final,
        reduced,
        parameters=parameters,
        free=free,
        places=places,
        residuals=-final.equations()["constant"],
        cofactors=cofactors,
    )


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
        """Find the parameters that have an effect at some values, or a weight."""
        core = self.problem.core(parameters, places, ~free)
        normal = reduce(self.problem, core, core.equations(), places).normal
        return (np.diag(normal + self.problem.parameter_weights) > 0) | ~free

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
            )
        except _photocore.StellarError as error:
            raise self._named(core, places, free, *error.args) from None
        # A sum of squares of the engine counts in units of the expected mean error.
        sums = [found["initial_sum_of_squares"], *(row[1] for row in found["iterations"])]
        levels = [math.sqrt(value / self.dof) * unit for value in sums]
        self.levels += levels[1:] if self.levels else levels
        if self.problem.options.common_scale:
            found["parameters"][13] = found["parameters"][12]
        return dict(found)

    def _named(
        self, core: Any, places: Floats, free: Bools, kind: str, message: str, stars: list[int]
    ) -> AdjustmentError:
        if kind == "undetermined stars":
            names = ", ".join(self.problem.star_ids[i] for i in stars)
            return AdjustmentError(f"ERROR 2: no inverse for the submatrix of star {names}")
        if kind == "undetermined":
            normal = reduce(self.problem, core, core.equations(), places).normal
            return singular(undetermined(normal + self.problem.parameter_weights, free, 1e-10))
        return AdjustmentError(message)

    def solved(self, found: dict[str, Any], free: Bools, unit: float) -> Solved:
        problem = self.problem
        plate, stars, weighted, axis = found["sums_of_squares"]
        status = found["status"]
        count = len(self.levels) - 1
        stops = {
            "converged": "NO UNKNOWN CHANGES BY MORE THAN 1E-4 OF ITS MEAN ERROR",
            "still": "THE SUM OF SQUARES STANDS STILL: NO CHANGE BY 1E-6 OF THE SQUARED MEAN ERROR",
            "diverged": "NO STEP LOWERS THE SUM OF SQUARES",
        }
        cofactors = found["cofactors"].reshape(len(NAMES), len(NAMES)) if len(found["cofactors"]) else None
        core = problem.core(found["parameters"], found["places"], ~free)
        reduced = reduce(problem, core, core.equations(), found["places"])
        tested = (problem.known & ~problem.held)[:, None]
        axis_residual = found["axis_residual"]
        return Solved(
            parameters=found["parameters"],
            places=found["places"],
            free=free,
            cofactors=np.full((len(NAMES), len(NAMES)), np.nan) if cofactors is None else cofactors,
            star_cofactors=found["place_cofactors"],
            star_inverse=reduced.star_inverse,
            residuals=-found["residuals"],
            redundancy=found["image_redundancy"],
            # The engine's residuals are observed minus computed, in units of the expected mean error.
            standardized=-unit * found["image_standardized"],
            star_redundancy=np.where(tested, found["place_redundancy"], np.nan),
            star_standardized=np.where(tested, -unit * found["place_standardized"], np.nan),
            axis_residual=None if axis_residual is None else -np.array(axis_residual),
            sums=(plate, stars, weighted + axis),
            log_determinant=log_determinant(reduced.normal + problem.parameter_weights, free),
            stop=stops.get(status, f"{count} ITERATIONS COMPLETED"),
            converged=status in ("converged", "still"),
            levels=tuple(Level(self.solution, i + 1, level) for i, level in enumerate(self.levels)),
        )
