"""Relative poses of photos."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import AXES, ROTATIONS, Observation

__all__ = ["Relative"]


@dataclass(frozen=True, eq=False)
class Relative(Observation):
    """The pose of one photo in the axes of another: odometry, a calibrated stereo rig.

    t = A_i' (C_j - C_i) and R = A_i' A_j, A being the matrix from photo to object.

    Parameters
    ----------
    first, second
        Names of the photos i and j.
    translation
        (3,) observed t in the axes of photo i (x right, y up, z back towards the viewer), in the linear unit.
    rotation
        (3, 3) observed R: its columns are the axes of photo j in those of photo i.
    sd
        (6,) standard deviations of the components of t in the linear unit, then of rotations about the axes
        of photo j in radians.
    covariance
        (6, 6) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        A photo with itself, values that are not finite, a matrix that is no rotation, both or none of `sd`
        and `covariance`, or such as give no weight.
    """

    KIND = "relative"
    PHOTOS = ("first", "second")
    VALUES = (("translation", (3,)), ("rotation", (3, 3)))
    COMPONENTS = (*AXES, *ROTATIONS)

    first: str
    second: str
    translation: ArrayLike
    rotation: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
