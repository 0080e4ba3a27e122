"""Points on unknown lines."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import Observation
from photogram.network.unknowns import Line, PlumbLine

__all__ = ["OnLine", "OnPlumbLine"]


@dataclass(frozen=True, eq=False)
class OnPlumbLine(Observation):
    """A point on a plumb line: (X - X0, Y - Y0).

    Parameters
    ----------
    point
        Its name.
    line
        The line.
    sd
        (2,) standard deviations of its offsets along X and Y or, in geographic space, east and north, in the
        linear unit, or one for both.
    covariance
        (2, 2) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        What is no such line, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "on plumb line"
    POINTS = ("point",)
    UNKNOWNS = (("line", PlumbLine),)
    NEEDS = frozenset({"line"})
    COMPONENTS = ("X", "Y")
    LOCAL = True

    point: str
    line: PlumbLine
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None


@dataclass(frozen=True, eq=False)
class OnLine(Observation):
    """A point on a straight line: T'(P - p0) - q, T the first two of the axes of the line.

    Parameters
    ----------
    point
        Its name.
    line
        The line.
    sd
        (2,) standard deviations of its offsets along the first two axes of the line, in the linear unit, or
        one for both.
    covariance
        (2, 2) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        What is no such line, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "on line"
    POINTS = ("point",)
    UNKNOWNS = (("line", Line),)
    NEEDS = frozenset({"line"})
    COMPONENTS = ("x", "y")

    point: str
    line: Line
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
