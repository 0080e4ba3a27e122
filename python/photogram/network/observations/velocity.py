"""Velocities from GNSS."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import AXES, Observation
from photogram.network.trajectories import Clock, Trajectory
from photogram.network.unknowns import LeverArm

__all__ = ["Velocity"]


@dataclass(frozen=True, eq=False)
class Velocity(Observation):
    """The velocity of the GNSS antenna of a photo that moves: C' + A [w]x l.

    Parameters
    ----------
    photo
        Its name, on a trajectory; None where it is of a trajectory itself.
    velocity
        (3,) in the linear unit a second, along X, Y, Z; geocentric where the object space is geographic.
    sd
        (3,) standard deviations of the same, or one for all.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.
    lever_arm
        (3,) l, from the projection centre to the antenna in the axes of the photo; or one that is unknown.
    trajectory, time, clock
        What it is of in the place of a photo, at a time in seconds, and the offset of that clock.

    Raises
    ------
    InputError
        Values that are not finite, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "velocity"
    PHOTOS = ("photo",)
    UNKNOWNS = (("lever_arm", LeverArm),)
    VALUES = (("velocity", (3,)), ("lever_arm", (3,)))
    COMPONENTS = AXES

    photo: str | None
    velocity: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    lever_arm: ArrayLike | LeverArm = 0.0
    trajectory: Trajectory | None = None
    time: float = 0.0
    clock: Clock | None = None

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Lengths in a second."""
        return (f"{linear_unit}/s",) * 3
