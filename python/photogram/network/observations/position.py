"""Positions of photos from GNSS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.network.observations.observation import AXES, Observation
from photogram.network.unknowns import Drift, LeverArm, Shift

__all__ = ["Position"]


@dataclass(frozen=True, eq=False)
class Position(Observation):
    """The position of the GNSS antenna of a photo: C + A l + s + d dt.

    Parameters
    ----------
    photo
        Its name.
    position
        (3,) observed X, Y, Z of the antenna; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations in the linear unit, or one for all: of X, Y, Z; or of east, north, up.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.
    lever_arm
        (3,) l, from the projection centre to the antenna in the axes of the photo (x right, y up, z back
        towards the viewer), in the linear unit; or one that is unknown.
    shift
        s; None without.
    drift
        d; None without. It counts from the mean time of the observations that it is given to.
    time
        Seconds.

    Raises
    ------
    InputError
        Values that are not finite, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "position"
    PHOTOS = ("photo",)
    UNKNOWNS = (("lever_arm", LeverArm), ("shift", Shift), ("drift", Drift))
    VALUES = (("position", (3,)), ("lever_arm", (3,)), ("time", ()))
    COMPONENTS = AXES
    LOCAL = True

    photo: str
    position: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    lever_arm: ArrayLike | LeverArm = 0.0
    shift: Shift | None = None
    drift: Drift | None = None
    time: float = 0.0

    @classmethod
    def values_of(cls, observations: Sequence[Observation]) -> Floats:
        """Return what the core takes; times count from the mean of those of one drift."""
        values = super().values_of(observations)
        drifts = [id(each.unknowns[-1]) for each in observations]
        for drift in set(drifts):
            own = np.array(drifts) == drift
            values[own, -1] -= values[own, -1].mean()
        return values
