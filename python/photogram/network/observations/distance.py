"""Distances between points, scale bars."""

from __future__ import annotations

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import Observation
from photogram.network.unknowns import Instrument

__all__ = ["Distance"]


@dataclass(frozen=True, eq=False)
class Distance(Observation):
    """The distance between two points: a tape, a rangefinder, the ends of a scale bar.

    The norm s of Q - P; of an instrument m s + k.

    Parameters
    ----------
    first, second
        Names of the points P and Q.
    length
        Observed, in the linear unit of the object space.
    sd
        Its standard deviation in the same unit.
    instrument
        Scale m and constant k of what it was measured with; None where these are 1 and 0.

    Raises
    ------
    InputError
        A point with itself, a length or a standard deviation that is not positive and finite.
    """

    KIND = "distance"
    POINTS = ("first", "second")
    UNKNOWNS = (("instrument", Instrument),)
    VALUES = (("length", ()),)
    COMPONENTS = ("length",)

    first: str
    second: str
    length: float
    sd: float
    instrument: Instrument | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.observed[0] > 0:
            raise InputError(f"length of {self.name} is not positive: {self.length}")
