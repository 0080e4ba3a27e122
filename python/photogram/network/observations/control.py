"""Control points whose coordinates are correlated."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import AXES, Observation

__all__ = ["Control"]


@dataclass(frozen=True, eq=False)
class Control(Observation):
    """The position of a point with its full covariance, as from an adjustment of its own.

    Parameters
    ----------
    point
        Its name.
    position
        (3,) observed X, Y, Z; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations in the linear unit, or one for all: of X, Y, Z; or of east, north, up.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        Values that are not finite, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "control"
    POINTS = ("point",)
    VALUES = (("position", (3,)),)
    COMPONENTS = AXES
    LOCAL = True

    point: str
    position: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
