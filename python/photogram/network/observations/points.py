"""Observations of points: control, distances, differences of coordinates, and surfaces that points are on."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import AXES, Observation
from photogram.network.unknowns import Instrument, Level, Line, Plane, PlumbLine


@dataclass(frozen=True, eq=False)
class Control(Observation):
    """The position of a point with its full covariance, as from an adjustment of its own.

    Parameters
    ----------
    point
        Its name.
    position
        (3,) observed X, Y, Z; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations in the linear unit, or one for all: of X, Y, Z; or of east, north, up.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        Values that are not finite, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "control"
    POINTS = ("point",)
    VALUES = (("position", (3,)),)
    COMPONENTS = AXES
    LOCAL = True

    point: str
    position: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None


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
    _POSITIVE = True

    first: str
    second: str
    length: float
    sd: float
    instrument: Instrument | None = None


@dataclass(frozen=True, eq=False)
class Difference(Observation):
    """The vector from one point to another, or some of its components: a GNSS baseline, taped offsets.

    Q - P along X, Y, Z; geocentric axes where the object space is geographic.

    Parameters
    ----------
    first, second
        Names of the points P and Q.
    vector
        (3,) observed components in the linear unit of the object space; NaN where not observed.
    sd
        (3,) their standard deviations, or one for all; what stands where nothing was observed does not count.
    covariance
        (3, 3) their covariance matrix, in place of `sd`.

    Raises
    ------
    InputError
        A point with itself, no component, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "difference"
    POINTS = ("first", "second")
    VALUES = (("vector", (3,)),)
    COMPONENTS = AXES
    MISSING = True

    first: str
    second: str
    vector: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None


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
