"""Points at one height."""

from __future__ import annotations

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import Observation

__all__ = ["EqualHeight"]


@dataclass(frozen=True, eq=False)
class EqualHeight(Observation):
    """Two points at one height, or with the difference of heights that was levelled.

    h = Z_Q - Z_P; heights above the ellipsoid where the object space is geographic.

    Parameters
    ----------
    first, second
        Names of the points P and Q.
    sd
        Standard deviation in the linear unit of the object space.
    difference
        Observed height of Q above P in the same unit.

    Raises
    ------
    InputError
        A point with itself, a difference that is not finite, a standard deviation that is not positive and
        finite.
    """

    KIND = "equal height"
    POINTS = ("first", "second")
    VALUES = (("difference", ()),)
    COMPONENTS = ("height",)

    first: str
    second: str
    sd: float
    difference: float = 0.0
