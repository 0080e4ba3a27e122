"""Solution of an iteration, with its history."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.problem import Counts, Problem, degrees_of_freedom
from photogram.words import Phrase


@dataclass(frozen=True, eq=False)
class Solved:
    """Solution of a run."""

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
        """Iterations after the initial values."""
        return len(self.levels) - 1

    @property
    def log10_determinant(self) -> float:
        """Decimal logarithm of the determinant of the reduced normal equations."""
        return self.log_determinant / math.log(10)


@dataclass(frozen=True, eq=False)
class PreRun:
    """Images not used in the minimum solution (option 7)."""

    points: tuple[str, ...]
    stars: tuple[str, ...]
    residuals: Floats  # (m, 2) computed minus measured, metres
