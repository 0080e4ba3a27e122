"""Differences of coordinates."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import AXES, Observation

__all__ = ["Difference"]


@dataclass(frozen=True, eq=False)
class Difference(Observation):
    """The vector from one point to another, or some of its components: a GNSS baseline, taped offsets.

    Q - P along X, Y, Z; geocentric axes where the object space is geographic.

    Parameters
    ----------
    first, second
        Names of the points P and Q.
    vector
        (3,) observed components in the linear unit of the object space; NaN where not observed.
    sd
        (3,) their standard deviations, or one for all; what stands where nothing was observed does not count.
    covariance
        (3, 3) their covariance matrix, in place of `sd`.

    Raises
    ------
    InputError
        A point with itself, no component, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "difference"
    POINTS = ("first", "second")
    VALUES = (("vector", (3,)),)
    COMPONENTS = AXES
    MISSING = True

    first: str
    second: str
    vector: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
