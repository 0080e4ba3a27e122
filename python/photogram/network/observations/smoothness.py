"""Smooth trajectories: sums of their coefficients that are zero."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import shaped, shown
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import Observation, all_trajectories
from photogram.network.trajectories import Coefficient, Trajectory
from photogram.network.unknowns import Unknown

__all__ = ["Smoothness", "smoothness_of", "with_smoothness"]


@dataclass(frozen=True, eq=False)
class Smoothness(Observation):
    """A sum of coefficients of a trajectory, each with its factor, that was observed: most often as zero.

    Parameters
    ----------
    coefficients
        Of one trajectory, all of positions or all of rotations.
    factors
        As many numbers.
    observed_sum
        (3,) what was observed; most often 0.
    sd
        (3,) standard deviations of x, y, z in the unit of the coefficients, or one for all.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        What is no coefficient, coefficients of two kinds, more or fewer factors.
    """

    KIND: ClassVar[str] = "smoothness"
    COMPONENTS: ClassVar[tuple[str, ...]] = ("x", "y", "z")

    coefficients: Sequence[Coefficient]
    factors: ArrayLike
    observed_sum: ArrayLike = 0.0
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        own = tuple(self.coefficients) if isinstance(self.coefficients, Sequence) else ()
        if not all(isinstance(each, Coefficient) for each in own) or len({each.KIND for each in own}) != 1:
            raise InputError(
                f"a smoothness is of coefficients of one kind, not of {shown(self.coefficients)}"
            )
        if len({id(each) for each in own}) < len(own):
            raise InputError("a smoothness has each of its coefficients once")
        self._set("coefficients", own)
        super().__post_init__()
        self._set("unknowns", own)
        factors = shaped("factors of a smoothness", self.factors, (len(own),))
        self._set("factors", factors)
        observed = np.concatenate([shaped("observed_sum", self.observed_sum, (3,)), factors])
        if not np.isfinite(observed).all():
            raise InputError(f"{self.name} has values that are not finite: {observed.tolist()}")
        self._set("observed", observed)

    @property
    def label(self) -> str:
        """Those of one kind and number of coefficients stand together."""
        return f"smoothness, {len(self.coefficients)} {self.coefficients[0].KIND}s"

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Those of the coefficients."""
        return self.coefficients[0].units(linear_unit)

    @property
    def of(self) -> tuple[str, ...]:
        """The coefficients."""
        return tuple(each.name for each in self.coefficients)


def smoothness_of(trajectory: Trajectory) -> list[Observation]:
    """Return what is observed of the coefficients of a trajectory together."""
    found: list[Observation] = []
    for basis, own in zip((trajectory.position, trajectory.rotation), trajectory.coefficients, strict=True):
        for numbers, factors, sd in [] if basis is None else basis.smoothed:
            found.append(Smoothness([own[k] for k in numbers], factors, sd=sd))
    return found


def with_smoothness(
    observations: Sequence[Observation], trajectories: Sequence[Trajectory]
) -> tuple[Observation, ...]:
    """Return observations with those of trajectories that are not among them."""
    known: set[Unknown | None] = set()
    for each in observations:
        if isinstance(each, Smoothness):
            known.update(each.unknowns)
    found = list(observations)
    for trajectory in all_trajectories(trajectories, observations):
        found += [each for each in smoothness_of(trajectory) if not known.issuperset(each.unknowns)]
    return tuple(found)
