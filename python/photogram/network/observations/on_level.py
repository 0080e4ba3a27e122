"""Points at an unknown height."""

from __future__ import annotations

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import Observation
from photogram.network.unknowns import Level

__all__ = ["OnLevel"]


@dataclass(frozen=True, eq=False)
class OnLevel(Observation):
    """A point at the height of a level, or so much above it: Z - h.

    Parameters
    ----------
    point
        Its name.
    level
        The level.
    sd
        Standard deviation in the linear unit of the object space.
    difference
        Observed height above the level in the same unit.

    Raises
    ------
    InputError
        What is no level, a difference that is not finite, a standard deviation that gives no weight.
    """

    KIND = "on level"
    POINTS = ("point",)
    UNKNOWNS = (("level", Level),)
    NEEDS = frozenset({"level"})
    VALUES = (("difference", ()),)
    COMPONENTS = ("height",)

    point: str
    level: Level
    sd: float
    difference: float = 0.0
