"""Distances between the sensors of a rig."""

from __future__ import annotations

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import Observation
from photogram.network.unknowns import Sensor

__all__ = ["Base"]


@dataclass(frozen=True, eq=False)
class Base(Observation):
    """The distance between two sensors on a frame, or of one from the frame itself.

    The norm of c_2 - c_1; a base that was measured gives a rig its scale.

    Parameters
    ----------
    first
        The first sensor; None for that which stands for the frame.
    second
        The second sensor.
    length
        Observed, in the linear unit of the object space.
    sd
        Its standard deviation in the same unit.

    Raises
    ------
    InputError
        What is no sensor, values that are not finite, a standard deviation that gives no weight.
    """

    KIND = "base"
    UNKNOWNS = (("first", Sensor), ("second", Sensor))
    NEEDS = frozenset({"second"})
    VALUES = (("length", ()),)
    COMPONENTS = ("length",)

    first: Sensor | None
    second: Sensor
    length: float
    sd: float
