"""Observations, unknowns, degrees of freedom (NOAA TR NOS 55, section 5.3 of its specification)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.problem import Problem

__all__ = ["Counts", "degrees_of_freedom"]


@dataclass(frozen=True)
class Counts:
    """What an adjustment counts.

    Attributes
    ----------
    plate_observations, star_observations, parameter_observations
        Plate coordinates with those of the axis; catalogue coordinates that have weight; parameters that have
        weight.
    parameter_unknowns, star_unknowns
        What is estimated.
    constraints
        Of a combined solution.
    """

    plate_observations: int
    star_observations: int
    parameter_observations: int
    parameter_unknowns: int
    star_unknowns: int
    constraints: int = 0

    @property
    def observations(self) -> int:
        """All together."""
        return self.plate_observations + self.star_observations + self.parameter_observations

    @property
    def unknowns(self) -> int:
        """All together."""
        return self.parameter_unknowns + self.star_unknowns

    @property
    def degrees_of_freedom(self) -> int:
        """Observations and constraints minus unknowns."""
        return self.observations + self.constraints - self.unknowns

    @property
    def usable(self) -> int:
        """Degrees of freedom, 1 where the solution is unique."""
        return self.degrees_of_freedom or 1


def degrees_of_freedom(problem: Problem, free: NDArray[np.bool_]) -> Counts:
    """Count observations and unknowns where the given parameters are estimated.

    Raises
    ------
    AdjustmentError
        There are fewer observations than unknowns (error 3).
    """
    free_stars = int((~problem.held).sum())
    counts = Counts(
        plate_observations=2 * len(problem.image_points) + 2 * (problem.axis is not None),
        star_observations=2 * int((problem.known & ~problem.held).sum()),
        parameter_observations=int((problem.weighted & free).sum()),
        parameter_unknowns=int(free.sum()),
        star_unknowns=2 * free_stars,
    )
    if counts.degrees_of_freedom < 0:
        raise AdjustmentError(
            f"ERROR 3: not enough observations: {counts.observations} for {counts.unknowns} unknowns"
        )
    return counts
