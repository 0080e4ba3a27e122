"""Values that an iteration has reached, and its history."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.problem import Counts, Problem, degrees_of_freedom
from photogram.words import Phrase


@dataclass(frozen=True)
class Level:
    """One pass of an iteration."""

    solution: str  # `minimum`, `maximum` or `refraction`
    number: int  # From 1
    # Level of discrepancies before its correction, metres. As published: root of the sum of squares of the
    # plate discrepancies over the degrees of freedom, with stars at their catalogue places. Else: root of the
    # whole weighted sum of squares over the degrees of freedom.
    level: float


@dataclass(frozen=True, eq=False)
class Solved:
    """The result of an iteration."""

    parameters: Floats  # (26,) values
    places: Floats  # (S, 2) adjusted places of the stars
    free: Bools  # (26,) which parameters were estimated
    cofactors: Floats  # (26, 26) for unit weight; zero for fixed parameters
    star_cofactors: Floats  # (S, 2, 2) of the places
    star_inverse: Floats  # (S, 2, 2) the same with known parameters: the report's (1)^-1
    residuals: Floats  # (m, 2) computed minus measured plate coordinates, metres
    redundancy: Floats  # (m, 2) of the images
    standardized: Floats
    star_redundancy: Floats  # (S, 2) of the catalogue places; NaN if they have no weight
    star_standardized: Floats
    axis_residual: Floats | None  # Computed minus measured plate coordinates of the axis
    sums: tuple[float, float, float]  # Weighted sums of squares of plate, stars, parameters (with the axis)
    log_determinant: (
        float  # Natural logarithm, of the reduced normal equations in the units of the parameters
    )
    stop: str  # Why the iteration stopped
    converged: bool  # Whether by its criterion
    levels: tuple[Level, ...]
    remarks: tuple[Phrase, ...] = ()

    @classmethod
    def of(cls, problem: Problem, found: dict[str, Any], *, unit: float = 1.0, **others: Any) -> Solved:
        """Return the result of the core for stars and images, and the other attributes.

        `unit` is the mean error of unit weight in the standardized residuals of the core.
        """
        observed = (problem.known & ~problem.held)[:, None]
        plate, stars, weighted, axis = found["sums_of_squares"]
        axis_residual = found["axis_residual"]
        # The residuals of the core are observed minus computed.
        return cls(
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


@dataclass(frozen=True)
class Stage:
    """One of the solutions of a run."""

    solution: str  # `minimum`, `maximum` or `refraction`
    counts: Counts
    levels: tuple[Level, ...]
    stop: str
    converged: bool
    log_determinant: float

    @classmethod
    def of(cls, problem: Problem, solved: Solved) -> Stage:
        """Return the stage of a solution."""
        levels, counts = solved.levels, degrees_of_freedom(problem, solved.free)
        return cls(levels[0].solution, counts, levels, solved.stop, solved.converged, solved.log_determinant)

    @property
    def iterations(self) -> int:
        """Iterations after the initial values."""
        return len(self.levels) - 1

    @property
    def log10_determinant(self) -> float:
        """Decimal logarithm of the determinant of the reduced normal equations."""
        return self.log_determinant / math.log(10)


@dataclass(frozen=True, eq=False)
class PreRun:
    """Images without a part in the minimum solution (option 7)."""

    points: tuple[str, ...]
    stars: tuple[str, ...]
    residuals: Floats  # (m, 2) computed minus measured, metres
