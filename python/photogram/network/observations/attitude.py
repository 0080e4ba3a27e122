"""Attitudes of photos from inertial units."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import ROTATIONS, Observation
from photogram.network.trajectories import Clock, Trajectory
from photogram.network.unknowns import Boresight

__all__ = ["Attitude"]


@dataclass(frozen=True, eq=False)
class Attitude(Observation):
    """The attitude of the body that carries a camera, as an inertial unit gives it: A B.

    Parameters
    ----------
    photo
        Its name; None where it is of a trajectory.
    attitude
        (3, 3) observed, body to object: its columns are the axes of the body in X, Y, Z; or in east, north,
        up at the photo where the object space is geographic.
    sd
        (3,) standard deviations of rotations about the axes of the body in radians, or one for all.
    covariance
        (3, 3) covariance matrix of the same in square radians, in place of `sd`.
    boresight
        (3, 3) B, body to the axes of the photo (x right, y up, z back towards the viewer); or one that is
        unknown. None where what is observed is the attitude of the photo itself.
    trajectory, time, clock
        What it is of in the place of a photo, at a time in seconds, and the offset of that clock.

    Raises
    ------
    InputError
        Matrices that are no rotations, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "attitude"
    PHOTOS = ("photo",)
    UNKNOWNS = (("boresight", Boresight),)
    VALUES = (("attitude", (3, 3)), ("boresight", (3, 3)))
    COMPONENTS = ROTATIONS

    photo: str | None
    attitude: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    boresight: ArrayLike | Boresight | None = None
    trajectory: Trajectory | None = None
    time: float = 0.0
    clock: Clock | None = None
