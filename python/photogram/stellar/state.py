"""Values that an iteration has reached, and how it got there."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass, field
from photogram.stellar.problem import Problem


@dataclass(frozen=True)
class Level:
    """One pass of an iteration."""

    solution: str  # `minimum`, `maximum` or `refraction`
    number: int  # From 1
    # Level of discrepancies before its correction, metres. As published: root of the sum of squares of
    # the plate discrepancies over the degrees of freedom, stars at their catalogue places. Else: root
    # of the whole weighted sum of squares over the degrees of freedom.
    level: float


@dataclass(frozen=True, eq=False)
class Solved:
    """What an iteration returns."""

    parameters: Floats  # (26,) values
    places: Floats  # (S, 2) adjusted places of the stars
    free: Bools  # (26,) which parameters were estimated
    cofactors: Floats  # (26, 26) for unit weight; zero for what was not
    # (S, 2, 2) of the places; and what of them would be left if the parameters were known: the report's
    # (1)^-1
    star_cofactors: Floats
    star_inverse: Floats
    residuals: Floats  # (m, 2) computed minus measured plate coordinates, metres
    redundancy: Floats  # (m, 2) of the images
    standardized: Floats
    star_redundancy: Floats  # (S, 2) of the catalogue places; NaN where there is none
    star_standardized: Floats
    axis_residual: Floats | None  # Computed minus measured plate coordinates of the axis
    sums: tuple[float, float, float]  # Weighted sums of squares of plate, stars, parameters (with the axis)
    # Natural logarithm of the determinant of the reduced normal equations in the units of the
    # parameters
    log_determinant: float
    stop: str  # Why the iteration stopped
    converged: bool  # Whether by its criterion
    levels: tuple[Level, ...]  # The history
    remarks: tuple[str, ...] = field(default=())  # What went on

    @classmethod
    def of(cls, problem: Problem, found: dict[str, Any], *, unit: float = 1.0, **rest: Any) -> Solved:
        """Take stars and images from what the core has found.

        Parameters
        ----------
        problem
            The problem.
        found
            What `StellarProblem.adjust` or `residual_cycle` returns.
        unit
            Mean error of unit weight that the standardized residuals count in.
        rest
            The other attributes.
        """
        tested = (problem.known & ~problem.held)[:, None]
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
            star_redundancy=np.where(tested, found["place_redundancy"], np.nan),
            star_standardized=np.where(tested, -unit * found["place_standardized"], np.nan),
            axis_residual=None if axis_residual is None else -np.array(axis_residual),
            sums=(plate, stars, weighted + axis),
            **rest,
        )
