"""Rates of rotation from gyroscopes."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import ROTATIONS, Observation
from photogram.network.trajectories import Clock, GyroBias, Trajectory
from photogram.network.unknowns import Boresight

__all__ = ["Rate"]


@dataclass(frozen=True, eq=False)
class Rate(Observation):
    """The rate of rotation of the body that carries a camera, as a gyroscope gives it: B' w + b.

    Parameters
    ----------
    photo
        Its name, on a trajectory; None where it is of a trajectory itself.
    rate
        (3,) about the axes of the body, in radians a second.
    sd
        (3,) standard deviations of the same, or one for all.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.
    boresight
        (3, 3) B, body to the axes of the photo; or one that is unknown. None: the identity.
    bias
        b; None without.
    trajectory, time, clock
        What it is of in the place of a photo, at a time in seconds, and the offset of that clock.

    Raises
    ------
    InputError
        Matrices that are no rotations, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "rate"
    PHOTOS = ("photo",)
    UNKNOWNS = (("boresight", Boresight), ("bias", GyroBias))
    VALUES = (("rate", (3,)), ("boresight", (3, 3)))
    COMPONENTS = ROTATIONS

    photo: str | None
    rate: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    boresight: ArrayLike | Boresight | None = None
    bias: GyroBias | None = None
    trajectory: Trajectory | None = None
    time: float = 0.0
    clock: Clock | None = None

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Radians a second."""
        return ("rad/s",) * 3
