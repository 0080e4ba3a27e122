"""Common unknowns that were determined before."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from photogram.network.observations.observation import Observation
from photogram.network.unknowns import Unknown

__all__ = ["Prior"]


@dataclass(frozen=True, eq=False)
class Prior(Observation):
    """What is given of a common unknown as one observation with its full covariance.

    Parameters
    ----------
    unknown
        The unknown; its own standard deviations are infinite.
    sd
        (k,) standard deviations of its unknowns, rotations in radians.
    covariance
        (k, k) their covariance matrix, in place of `sd`.

    Raises
    ------
    InputError
        What is no unknown, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "prior"
    UNKNOWNS = (("unknown", Unknown),)
    NEEDS = frozenset({"unknown"})

    unknown: Unknown
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    @property
    def label(self) -> str:
        """Those of one type stand together."""
        return f"prior, {self.unknown.KIND}"

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Those of the unknown."""
        return self.unknown.units(linear_unit)

    @property
    def own_components(self) -> tuple[str, ...]:
        """Those of the unknown."""
        return self.unknown.components
