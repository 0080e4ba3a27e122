"""Common unknowns that were determined before."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import shaped
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import Observation
from photogram.network.unknowns import Unknown

__all__ = ["Prior"]


@dataclass(frozen=True, eq=False)
class Prior(Observation):
    """What was observed of a common unknown as one observation with its full covariance.

    Parameters
    ----------
    unknown
        The unknown; its own standard deviations are infinite.
    sd
        (k,) standard deviations of its unknowns, rotations in radians.
    covariance
        (k, k) their covariance matrix, in place of `sd`.
    value
        (k,) what was observed of them, in the place of what the unknown is given; not of rotations.

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
    value: ArrayLike | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.value is None:
            return
        count = len(self.unknown.components)
        value = shaped(f"value of {self.name}", self.value, (count,))
        if not np.isfinite(value).all() or count > 3:
            raise InputError(f"value of {self.name} is not finite, or of rotations: {value.tolist()}")
        self._set("value", value)
        self._set("observed", value - self.unknown.position[:count])

    @property
    def label(self) -> str:
        """Those of one type stand together."""
        return f"prior, {self.unknown.KIND}" + ("" if self.value is None else ", observed")

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Those of the unknown."""
        return self.unknown.units(linear_unit)

    @property
    def own_components(self) -> tuple[str, ...]:
        """Those of the unknown."""
        return self.unknown.components
