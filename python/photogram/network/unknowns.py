"""Unknowns that observations have in common: lever arms, shifts, drifts, boresights, instruments, surfaces.

Each is an object with a name; the observations that it is given to share it. Its values are where the
adjustment starts from and, where its standard deviations are neither 0 (known) nor infinite (free), observed.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import argument_error, names, number, shaped
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.words import phrase

__all__ = [
    "Boresight",
    "Drift",
    "Instrument",
    "Level",
    "LeverArm",
    "Line",
    "Numbers",
    "Plane",
    "PlumbLine",
    "Sensor",
    "Shift",
    "Unknown",
    "UnknownRow",
    "different_unknowns",
    "rotation",
]

UnknownRow = tuple[str, list[float], list[float], list[float]]
"""Type, position, rotation matrix row by row and standard deviations, as the core takes an unknown."""

_ORTHONORMAL = 1e-6
_UNKNOWNS = dict(_photocore.UNKNOWNS)


def rotation(name: str, value: ArrayLike) -> Floats:
    """Return a (3, 3) rotation matrix; InputError where it is not orthonormal to six digits, or mirrored."""
    matrix = shaped(name, value, (3, 3))
    orthonormal = np.abs(matrix.T @ matrix - np.eye(3)).max() < _ORTHONORMAL
    if not orthonormal or np.linalg.det(matrix) < 0:
        raise kind_error(name, "a rotation matrix (with the determinant 1)", matrix.tolist())
    return matrix


@cache
def _components(kind: str) -> tuple[str, ...]:
    return tuple(name for name, _ in _UNKNOWNS[kind])


@cache
def _units(kind: str, linear_unit: str) -> tuple[str, ...]:
    units = {"length": linear_unit, "speed": f"{linear_unit}/s", "angle": "rad", "ratio": ""}
    units |= {"rate": "rad/s", "time": "s", "in image": "mm", "per image": "1/mm"}
    return tuple(units[measure] for _, measure in _UNKNOWNS[kind])


@dataclass(frozen=True, eq=False)
class Unknown:
    """What all have in common.

    Attributes
    ----------
    name
        For reports.
    position, attitude
        (3,) and (3, 3) what the core takes: where it is, and its own axes as columns.
    deviations
        (k,) standard deviations of its unknowns.
    """

    KIND: ClassVar[str] = ""
    """The name under which results know the type."""
    GIVEN: ClassVar[tuple[str, ...]] = ()
    """Fields that say where it is, and may be None, all of them, where nothing is known of it."""

    position: Floats = field(init=False, repr=False)
    attitude: Floats = field(init=False, repr=False)
    deviations: Floats = field(init=False, repr=False)
    name: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", names(f"name of a {self.KIND}", [self.name])[0])
        self._set("position", self._position())
        self._set("attitude", self._attitude())
        deviations = shaped(f"sd of {self.title}", getattr(self, "sd"), (len(self.components),))  # noqa: B009
        if not (deviations >= 0).all():
            raise argument_error(f"sd of {self.title}", "not-negative", value=deviations.tolist())
        self._set("deviations", deviations)
        if self.is_open and not np.isinf(deviations).all():
            raise InputError(phrase("block.unknown-value", unknown=self.title, names=list(self.GIVEN)))

    @property
    def is_open(self) -> bool:
        """Whether nobody has said where it is: an adjustment begins where points and photos have it."""
        return all(getattr(self, name) is None for name in self.GIVEN) and bool(self.GIVEN)

    def replace(self, **changes: Any) -> Self:
        """Return it with some fields replaced, checked anew."""
        return replace(self, **changes)

    def _set(self, name: str, value: Floats) -> None:
        if not np.isfinite(value).all() and name != "deviations":
            raise argument_error(f"value of {self.title}", "finite", value=value.tolist())
        object.__setattr__(self, name, value)

    def _position(self) -> Floats:
        raise NotImplementedError

    def _attitude(self) -> Floats:
        return np.eye(3)

    @property
    def title(self) -> str:
        """Its type and name."""
        return f"{self.KIND} {self.name}"

    @property
    def components(self) -> tuple[str, ...]:
        """The names of its k unknowns."""
        return _components(self.KIND)

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of its unknowns; nothing for plain numbers."""
        return _units(self.KIND, linear_unit)

    @property
    def is_held(self) -> bool:
        """Whether nothing of it is unknown."""
        return not self.deviations.any()

    def row(self) -> UnknownRow:
        """Return what the core takes."""
        return self.KIND, self.position.tolist(), self.attitude.ravel().tolist(), self.deviations.tolist()


@dataclass(frozen=True, eq=False)
class Numbers(Unknown):
    """One to three numbers and their standard deviations.

    Parameters
    ----------
    name
        For reports.
    value, sd
        Of its unknowns, or one for all.
    """

    value: ArrayLike = 0.0
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        count = len(self.components)
        return np.append(shaped(f"value of {self.title}", self.value, (count,)), np.zeros(3 - count))


@dataclass(frozen=True, eq=False)
class LeverArm(Numbers):
    """The vector l from the projection centre to the antenna, in the axes of the photo.

    Parameters
    ----------
    name
        For reports.
    value
        (3,) x right, y up, z back towards the viewer, in the linear unit.
    sd
        (3,) standard deviations of the same, or one for all.
    """

    KIND = "lever arm"


@dataclass(frozen=True, eq=False)
class Shift(Numbers):
    """The vector s that GNSS positions of a strip, a flight or a session are off by.

    Parameters
    ----------
    name
        For reports.
    value
        (3,) along X, Y, Z or, in geographic space, east, north and up amid the photos, in the linear unit.
    sd
        (3,) standard deviations of the same, or one for all.
    """

    KIND = "shift"


@dataclass(frozen=True, eq=False)
class Drift(Numbers):
    """The vector d by which that grows in a second.

    Parameters
    ----------
    name
        For reports.
    value
        (3,) in the axes of a shift, in the linear unit a second.
    sd
        (3,) standard deviations of the same, or one for all.
    epoch
        The time that it counts from, in seconds; None: the mean time of its observations.
    """

    KIND = "drift"

    epoch: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.epoch is not None:
            epoch = number(f"epoch of {self.title}", self.epoch)
            require(np.isfinite(epoch), f"epoch of {self.title}", "finite", value=epoch)
            object.__setattr__(self, "epoch", epoch)


@dataclass(frozen=True, eq=False)
class Boresight(Unknown):
    """The rotation B from an inertial unit to the photo.

    Parameters
    ----------
    name
        For reports.
    value
        (3, 3) body to the axes of the photo: the transposed mounting, or what is known of it. None: where it
        is free, the mean of what photos and observed attitudes make of it; otherwise the identity.
    sd
        (3,) standard deviations of rotations about the axes of the body in radians, or one for all.
    """

    KIND = "boresight"

    value: ArrayLike | None = None
    sd: ArrayLike = np.inf

    @property
    def is_open(self) -> bool:
        """Whether it is free, and nobody has said what it is about."""
        return self.value is None and bool(np.isinf(self.deviations).all())

    def _position(self) -> Floats:
        return np.zeros(3)

    def _attitude(self) -> Floats:
        return np.eye(3) if self.value is None else rotation(f"value of {self.title}", self.value)


@dataclass(frozen=True, eq=False)
class Instrument(Unknown):
    """The scale m and constant k of an instrument for distances: it shows m s + k.

    Parameters
    ----------
    name
        For reports.
    scale, constant
        m, a number, and k in the linear unit.
    sd
        (2,) standard deviations of the same, or one for both.
    """

    KIND = "instrument"

    scale: float = 1.0
    constant: float = 0.0
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        scale = number(f"scale of {self.title}", self.scale)
        return np.array([scale, number(f"constant of {self.title}", self.constant), 0.0])


@dataclass(frozen=True, eq=False)
class Level(Unknown):
    """A height h that points have in common: a water line, a levelling instrument.

    Parameters
    ----------
    name
        For reports.
    height
        Z, or the height above the ellipsoid in geographic space, in the linear unit. None: the mean of its
        points.
    sd
        Its standard deviation.
    """

    KIND = "level"
    GIVEN = ("height",)

    height: float | None = None
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        height = 0.0 if self.height is None else number(f"height of {self.title}", self.height)
        return np.array([0.0, 0.0, height])


@dataclass(frozen=True, eq=False)
class PlumbLine(Unknown):
    """A vertical line.

    Parameters
    ----------
    name
        For reports.
    through
        (3,) a place near it: X, Y, Z; or longitude (rad), latitude (rad), height. None: the middle of its
        points.
    sd
        (2,) standard deviations of its offset from there along X and Y or, in geographic space, east and
        north.
    """

    KIND = "plumb line"
    GIVEN = ("through",)

    through: ArrayLike | None = None
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        return _place(self, self.through)


@dataclass(frozen=True, eq=False)
class Line(Unknown):
    """A straight line.

    Parameters
    ----------
    name
        For reports.
    direction
        (3,) of any length, in X, Y, Z or, in geographic space, east, north and up at `through`. None, with
        `through`: a principal axis of its points.
    through
        (3,) a place near it: X, Y, Z; or longitude (rad), latitude (rad), height.
    sd
        (4,) standard deviations of its offsets from there along two axes of its own, across it (columns of
        `attitude`), and of rotations about these in radians.
    """

    KIND = "line"
    GIVEN = ("direction", "through")

    direction: ArrayLike | None = None
    through: ArrayLike | None = None
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        return _place(self, self.through)

    def _attitude(self) -> Floats:
        return np.eye(3) if self.is_open else _across(f"direction of {self.title}", self.direction)


@dataclass(frozen=True, eq=False)
class Plane(Unknown):
    """A plane.

    Parameters
    ----------
    name
        For reports.
    normal
        (3,) of any length, in X, Y, Z or, in geographic space, east, north and up at `through`. None, with
        `through`: a principal axis of its points.
    through
        (3,) a place near it: X, Y, Z; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations of its distance from there along the normal, and of rotations about two axes
        of its own in it (columns of `attitude`) in radians.
    """

    KIND = "plane"
    GIVEN = ("normal", "through")

    normal: ArrayLike | None = None
    through: ArrayLike | None = None
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        return _place(self, self.through)

    def _attitude(self) -> Floats:
        return np.eye(3) if self.is_open else _across(f"normal of {self.title}", self.normal)


@dataclass(frozen=True, eq=False)
class Sensor(Unknown):
    """The pose of a camera on a frame (see :class:`photogram.network.Mount`).

    Parameters
    ----------
    name
        For reports.
    value
        (3,) c, its position in the axes of the frame (x right, y up, z back), in the linear unit. None, with
        `matrix`: the middle of what the first poses of frames and photos make of it.
    matrix
        (3, 3) its axes in those of the frame, as columns. None with a given position: the identity.
    sd
        (6,) standard deviations of c, then of rotations about the sensor's own axes in radians.
    """

    KIND = "sensor"
    GIVEN = ("value", "matrix")

    value: ArrayLike | None = None
    matrix: ArrayLike | None = None
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        return _place(self, self.value, "value")

    def _attitude(self) -> Floats:
        return np.eye(3) if self.matrix is None else rotation(f"matrix of {self.title}", self.matrix)

    @classmethod
    def from_colmap(
        cls, name: str, matrix: ArrayLike, translation: ArrayLike, sd: ArrayLike = np.inf
    ) -> Self:
        """Return the sensor of COLMAP's `sensor_from_rig`: R (3, 3) and t (3,), y down and z forward.

        A = F R' F and c = -F R' t with F = diag(1, -1, -1).
        """
        turned = rotation(f"matrix of sensor {name}", matrix).T
        flip = np.diag([1.0, -1.0, -1.0])
        value = -flip @ turned @ shaped(f"translation of sensor {name}", translation, (3,))
        return cls(name, value, flip @ turned @ flip, sd)


def _place(own: Unknown, value: ArrayLike | None, what: str = "through") -> Floats:
    """Return (3,) where it is; zero of what is open."""
    if own.is_open:
        return np.zeros(3)
    if value is None:
        raise InputError(phrase("block.unknown-value", unknown=own.title, names=list(own.GIVEN)))
    return shaped(f"{what} of {own.title}", value, (3,))


def _across(name: str, value: ArrayLike | None) -> Floats:
    """Return axes of which the third has a direction."""
    if value is None:
        raise argument_error(name, "requires", name="through", other="a direction")
    third = shaped(name, value, (3,))
    length = float(np.linalg.norm(third))
    good = length > 0 and np.isfinite(length)
    require(good, name, "kind", kind="a vector with a positive length", value=third.tolist())
    third = third / length
    first = np.cross(np.eye(3)[np.abs(third).argmin()], third)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(third, first), third])


def different_unknowns(unknowns: Iterable[Unknown]) -> list[Unknown]:
    """Return unknowns, each once, in their order; refuse two of one type and name."""
    distinct = list({id(each): each for each in unknowns}.values())
    titles: set[str] = set()
    for each in distinct:
        if each.title in titles:
            raise InputError(phrase("block.repeated-object", kind="unknown", name=each.title))
        titles.add(each.title)
    return distinct
