"""Observations of points: control, distances, differences of coordinates, and points on surfaces."""

from __future__ import annotations

from numpy.typing import ArrayLike

from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import AXES, Observation
from photogram.network.unknowns import Instrument, Level, Line, Plane, PlumbLine


@dataclass(frozen=True, eq=False)
class Control(Observation):
    """Observed position of a point with full covariance, e.g. from a separate adjustment.

    Parameters
    ----------
    point
        Name of the point.
    position
        (3,) observed X, Y, Z; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations in the linear unit, or one for all; along X, Y, Z or east, north, up.
    covariance
        (3, 3) covariance matrix of the position, instead of `sd`.

    Raises
    ------
    InputError
        If a value is not finite, or weights are invalid: exactly one of `sd` and `covariance` is required.
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
    """Observed distance between two points, e.g. by tape, rangefinder or scale bar.

    The observed value is s = ||Q - P||, or m s + k with an instrument.

    Parameters
    ----------
    first, second
        Names of the points P and Q.
    length
        Observed distance in the linear unit of the object space.
    sd
        Standard deviation of the distance in the same unit.
    instrument
        Instrument with scale m and constant k; None for 1 and 0.

    Raises
    ------
    InputError
        If both points are the same, or a length or standard deviation is not positive and finite.
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
    """Observed vector between two points, or some components, e.g. a GNSS baseline.

    Q - P along X, Y, Z; along geocentric axes if the object space is geographic.

    Parameters
    ----------
    first, second
        Names of the points P and Q.
    vector
        (3,) components in the linear unit of the object space; NaN if not observed.
    sd
        (3,) standard deviations, or one for all; ignored for components that were not observed.
    covariance
        (3, 3) covariance matrix of the vector, instead of `sd`.

    Raises
    ------
    InputError
        If both points are the same, no component was observed, or not exactly one of `sd` and `covariance` is
        given.
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
    """Equal height of two points, or a levelled height difference.

    h = Z_Q - Z_P; the difference of ellipsoidal heights if the object space is geographic.

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
        If both points are the same, the difference is not finite, or the standard deviation is not positive
        and finite.
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
    """Height of a point relative to a level: Z - h.

    Parameters
    ----------
    point
        Name of the point.
    level
        Level with unknown height.
    sd
        Standard deviation in the linear unit of the object space.
    difference
        Observed height above the level in the same unit.

    Raises
    ------
    InputError
        If the level is invalid, the difference is not finite, or the standard deviation is invalid.
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
    """Distance of a point from a plane, usually 0: n.(P - p0) - d.

    Parameters
    ----------
    point
        Name of the point.
    plane
        Plane with unknown parameters.
    sd
        Standard deviation in the linear unit of the object space: flatness of the plane.
    distance
        Observed distance from the plane along its normal, in the same unit.

    Raises
    ------
    InputError
        If the plane is invalid, the distance is not finite, or the standard deviation is invalid.
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
    """Point on a plumb line: (X - X0, Y - Y0).

    Parameters
    ----------
    point
        Name of the point.
    line
        Plumb line with unknown position.
    sd
        (2,) standard deviations of the offsets along X and Y (east and north in geographic space) in the
        linear unit, or one for both.
    covariance
        (2, 2) covariance matrix of the offsets, instead of `sd`.

    Raises
    ------
    InputError
        If the line is invalid, or not exactly one of `sd` and `covariance` is given with valid weights.
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
    """Point on a straight line: T'(P - p0) - q, with the first two axes T of the line.

    Parameters
    ----------
    point
        Name of the point.
    line
        Line with unknown parameters.
    sd
        (2,) standard deviations of the offsets along the first two axes of the line, in the linear unit, or
        one for both.
    covariance
        (2, 2) covariance matrix of the offsets, instead of `sd`.

    Raises
    ------
    InputError
        If the line is invalid, or not exactly one of `sd` and `covariance` is given with valid weights.
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
