"""Ranges from photos to points: laser altimeters, rangefinders beside a camera."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import Observation
from photogram.network.trajectories import Clock, Trajectory
from photogram.network.unknowns import Instrument

__all__ = ["Range"]


@dataclass(frozen=True, eq=False)
class Range(Observation):
    """The distance of a point from a rangefinder that moves with a photo.

    The norm s of P - C - A l; of an instrument m s + k.

    Parameters
    ----------
    photo
        Its name; None where it is of a trajectory.
    point
        The name of the point P.
    length
        Observed, in the linear unit of the object space.
    sd
        Its standard deviation in the same unit.
    lever_arm
        (3,) l, from the projection centre to the rangefinder in the axes of the photo (x right, y up, z back
        towards the viewer), in the linear unit; known.
    instrument
        Scale m and constant k of the rangefinder; None where these are 1 and 0.
    trajectory, time, clock
        What it is of in the place of a photo, at a time in seconds, and the offset of that clock.

    Raises
    ------
    InputError
        A length or a standard deviation that is not positive and finite, a lever arm that is not finite.
    """

    KIND = "range"
    POINTS = ("point",)
    PHOTOS = ("photo",)
    UNKNOWNS = (("instrument", Instrument),)
    VALUES = (("length", ()), ("lever_arm", (3,)))
    COMPONENTS = ("length",)

    photo: str | None
    point: str
    length: float
    sd: float
    lever_arm: ArrayLike = 0.0
    instrument: Instrument | None = None
    trajectory: Trajectory | None = None
    time: float = 0.0
    clock: Clock | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.observed[0] > 0:
            raise InputError(f"length of {self.name} is not positive: {self.length}")
