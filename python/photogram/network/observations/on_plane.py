"""Points on an unknown plane."""

from __future__ import annotations

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import Observation
from photogram.network.unknowns import Plane

__all__ = ["OnPlane"]


@dataclass(frozen=True, eq=False)
class OnPlane(Observation):
    """A point on a plane, or at a distance from it: n.(P - p0) - d.

    Parameters
    ----------
    point
        Its name.
    plane
        The plane.
    sd
        Standard deviation in the linear unit of the object space: how flat the plane is.
    distance
        Observed distance from it along its normal, in the same unit.

    Raises
    ------
    InputError
        What is no plane, a distance that is not finite, a standard deviation that gives no weight.
    """

    KIND = "on plane"
    POINTS = ("point",)
    UNKNOWNS = (("plane", Plane),)
    NEEDS = frozenset({"plane"})
    VALUES = (("distance", ()),)
    COMPONENTS = ("distance",)

    point: str
    plane: Plane
    sd: float
    distance: float = 0.0
