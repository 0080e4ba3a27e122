"""Unknowns shared by observations: lever arms, shifts, drifts, boresights, instruments, surfaces.

Each unknown is an object with a name, shared by the observations that contain it. Its values are initial
values. They are also observations if their standard deviations are neither 0 (fixed) nor infinite (free).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache, partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import argument_error, names, number, shaped
from photogram.arguments.fields import check_fields
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.words import phrase

UnknownRow = tuple[str, list[float], list[float], list[float]]
"""Type, position, rotation matrix row by row, and standard deviations: the row of an unknown for the core."""

_ORTHONORMAL = 1e-6
ROTATION = "a rotation matrix (with the determinant 1)"
_UNKNOWNS = dict(_photocore.UNKNOWNS)


def are_rotations(matrices: Floats) -> Bools:
    """Return which (..., 3, 3) matrices are orthonormal to 1e-6 and not mirrored."""
    apart = np.abs(np.swapaxes(matrices, -1, -2) @ matrices - np.eye(3)).max(axis=(-1, -2))
    return np.asarray((apart < _ORTHONORMAL) & (np.linalg.det(matrices) > 0))


def rotations(name: str, values: ArrayLike, *count: int) -> Floats:
    """Return rotation matrices (*count, 3, 3); InputError if one is mirrored or not orthonormal to 1e-6."""
    matrices = shaped(name, values, (*count, 3, 3))
    if wrong := np.argwhere(~are_rotations(matrices)).tolist():
        raise kind_error(f"{name}{wrong[0] or ''}", ROTATION, matrices[tuple(wrong[0])].tolist())
    return matrices


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
    """Base class of shared unknowns.

    Attributes
    ----------
    name
        Name in reports.
    position, attitude
        (3,) position and (3, 3) axes as columns, for the core.
    deviations
        (k,) standard deviations of the k components.
    """

    KIND: ClassVar[str] = ""
    """Name of the type in results."""
    GIVEN: ClassVar[tuple[str, ...]] = ()
    """Fields of the initial values; all of them may be None if they are unknown."""
    _PLACE: ClassVar[str] = "through"  # Field of the position
    _TURN: ClassVar[str] = ""  # Field of the rotation matrix
    _VALUES: ClassVar[slice] = slice(0)
    """Elements of the position that are the values of the first components; the others are changes."""

    position: Floats = field(init=False, repr=False)
    attitude: Floats = field(init=False, repr=False)
    deviations: Floats = field(init=False, repr=False)
    name: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", names(f"name of a {self.KIND}", [self.name])[0])
        check_fields(self, self.title)
        self._set("position", self._position())
        self._set("attitude", self._attitude())
        sd: Any = getattr(self, "sd")  # noqa: B009
        self._set("deviations", shaped(f"sd of {self.title}", sd, (len(self.components),), "sd"))
        deviations = self.deviations
        if self.is_open and not np.isinf(deviations).all():
            raise InputError(phrase("block.unknown-value", unknown=self.title, names=list(self.GIVEN)))

    @property
    def is_open(self) -> bool:
        """Whether initial values are missing; they are then computed from points and photos."""
        return all(getattr(self, name) is None for name in self.GIVEN) and bool(self.GIVEN)

    def replace(self, **changes: Any) -> Self:
        """Return a validated unknown with some fields replaced."""
        return replace(self, **changes)

    def _set(self, name: str, value: Floats) -> None:
        if not np.isfinite(value).all() and name != "deviations":
            what = " or ".join(self.GIVEN) or "value"
            raise argument_error(f"{what} of {self.title}", "finite", value=value.tolist())
        object.__setattr__(self, name, value)

    def _position(self) -> Floats:
        if self.is_open:
            return np.zeros(3)
        value = getattr(self, self._PLACE)
        if value is None:
            raise InputError(phrase("block.unknown-value", unknown=self.title, names=list(self.GIVEN)))
        return shaped(f"{self._PLACE} of {self.title}", value, (3,))

    def _attitude(self) -> Floats:
        value = getattr(self, self._TURN, None)
        return np.eye(3) if value is None else rotations(f"{self._TURN} of {self.title}", value)

    @property
    def title(self) -> str:
        """Type and name."""
        return f"{self.KIND} {self.name}"

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the k components."""
        return _components(self.KIND)

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the components; empty for dimensionless numbers."""
        return _units(self.KIND, linear_unit)

    @property
    def is_held(self) -> bool:
        """Whether all components are fixed."""
        return not self.deviations.any()

    def row(self) -> UnknownRow:
        """Return the row for the core."""
        return self.KIND, self.position.tolist(), self.attitude.ravel().tolist(), self.deviations.tolist()


@dataclass(frozen=True, eq=False)
class Numbers(Unknown):
    """Unknown with one to three numbers.

    Parameters
    ----------
    name
        Name in reports.
    value, sd
        Values and standard deviations of the components, or one for all.
    """

    _VALUES = slice(3)

    value: ArrayLike = 0.0
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        count = len(self.components)
        return np.append(shaped(f"value of {self.title}", self.value, (count,)), np.zeros(3 - count))


@dataclass(frozen=True, eq=False)
class LeverArm(Numbers):
    """Vector l from the projection centre to the antenna, in the axes of the photo.

    Parameters
    ----------
    name
        Name in reports.
    value
        (3,) x right, y up, z back towards the viewer, in the linear unit.
    sd
        (3,) standard deviations of the vector, or one for all.
    """

    KIND = "lever arm"


@dataclass(frozen=True, eq=False)
class Shift(Numbers):
    """Shift s of the GNSS positions of a strip, a flight or a session.

    Parameters
    ----------
    name
        Name in reports.
    value
        (3,) along X, Y, Z, or east, north, up at the photos in geographic space, in the linear unit.
    sd
        (3,) standard deviations of the shift, or one for all.
    """

    KIND = "shift"


@dataclass(frozen=True, eq=False)
class Drift(Numbers):
    """Drift d of GNSS positions: change of the shift per second.

    Parameters
    ----------
    name
        Name in reports.
    value
        (3,) in the axes of a shift, in the linear unit per second.
    sd
        (3,) standard deviations of the drift, or one for all.
    epoch
        Reference time in seconds; None: the mean time of its observations.
    """

    KIND = "drift"

    epoch: float | None = field(default=None, metadata={"check": partial(number, rule="finite")})


@dataclass(frozen=True, eq=False)
class Boresight(Unknown):
    """Rotation B from an inertial unit to the photo.

    Parameters
    ----------
    name
        Name in reports.
    value
        (3, 3) body to the axes of the photo: the transposed mounting, or an approximation. None: the mean
        from photos and observed attitudes if it is free, else the identity.
    sd
        (3,) standard deviations of rotations about the axes of the body in radians, or one for all.
    """

    KIND = "boresight"
    _TURN = "value"

    value: ArrayLike | None = None
    sd: ArrayLike = np.inf

    @property
    def is_open(self) -> bool:
        """Whether the boresight is free and its initial value is missing."""
        return self.value is None and bool(np.isinf(self.deviations).all())

    def _position(self) -> Floats:
        return np.zeros(3)


@dataclass(frozen=True, eq=False)
class Instrument(Unknown):
    """Scale m and constant k of an instrument for distances: it measures m s + k.

    Parameters
    ----------
    name
        Name in reports.
    scale, constant
        m, dimensionless, and k in the linear unit.
    sd
        (2,) standard deviations of m and k, or one for both.
    """

    KIND = "instrument"
    _VALUES = slice(3)

    scale: float = 1.0
    constant: float = 0.0
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        return np.array([self.scale, self.constant, 0.0])


@dataclass(frozen=True, eq=False)
class Level(Unknown):
    """Common height h of points, e.g. a water line or a levelling instrument.

    Parameters
    ----------
    name
        Name in reports.
    height
        Z, or the height above the ellipsoid in geographic space, in the linear unit. None: the mean of its
        points.
    sd
        Standard deviation of the height.
    """

    KIND = "level"
    _VALUES = slice(2, 3)
    GIVEN = ("height",)

    height: float | None = None
    sd: ArrayLike = np.inf

    def _position(self) -> Floats:
        return np.array([0.0, 0.0, self.height or 0.0])


@dataclass(frozen=True, eq=False)
class PlumbLine(Unknown):
    """Vertical line.

    Parameters
    ----------
    name
        Name in reports.
    through
        (3,) a position near the line: X, Y, Z; or longitude (rad), latitude (rad), height. None: the centre
        of its points.
    sd
        (2,) standard deviations of the offset from `through` along X and Y (east and north in geographic
        space).
    """

    KIND = "plumb line"
    GIVEN = ("through",)

    through: ArrayLike | None = None
    sd: ArrayLike = np.inf


@dataclass(frozen=True, eq=False)
class Line(Unknown):
    """Straight line.

    Parameters
    ----------
    name
        Name in reports.
    direction
        (3,) of any length, in X, Y, Z or, in geographic space, east, north and up at `through`. None,
        together with `through`: a principal axis of its points.
    through
        (3,) a position near the line: X, Y, Z; or longitude (rad), latitude (rad), height.
    sd
        (4,) standard deviations of the offsets from `through` along two axes across the line (columns of
        `attitude`), and of rotations about these axes in radians.
    """

    KIND = "line"
    GIVEN = ("direction", "through")

    direction: ArrayLike | None = None
    through: ArrayLike | None = None
    sd: ArrayLike = np.inf

    def _attitude(self) -> Floats:
        return np.eye(3) if self.is_open else _across(f"direction of {self.title}", self.direction)


@dataclass(frozen=True, eq=False)
class Plane(Unknown):
    """Plane.

    Parameters
    ----------
    name
        Name in reports.
    normal
        (3,) of any length, in X, Y, Z or, in geographic space, east, north and up at `through`. None,
        together with `through`: a principal axis of its points.
    through
        (3,) a position near the plane: X, Y, Z; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations of the distance from `through` along the normal, and of rotations about two
        axes in the plane (columns of `attitude`) in radians.
    """

    KIND = "plane"
    GIVEN = ("normal", "through")

    normal: ArrayLike | None = None
    through: ArrayLike | None = None
    sd: ArrayLike = np.inf

    def _attitude(self) -> Floats:
        return np.eye(3) if self.is_open else _across(f"normal of {self.title}", self.normal)


@dataclass(frozen=True, eq=False)
class Sensor(Unknown):
    """Pose of a camera on a frame (see :class:`photogram.network.Mount`).

    Parameters
    ----------
    name
        Name in reports.
    value
        (3,) c, position in the axes of the frame (x right, y up, z back), in the linear unit. None, together
        with `matrix`: the centre of the values from the initial poses of frames and photos.
    matrix
        (3, 3) axes in the system of the frame, as columns. None with a given position: the identity.
    sd
        (6,) standard deviations of c, then of rotations about the sensor's own axes in radians.
    """

    KIND = "sensor"
    _VALUES = slice(3)
    GIVEN = ("value", "matrix")
    _PLACE, _TURN = "value", "matrix"

    value: ArrayLike | None = None
    matrix: ArrayLike | None = None
    sd: ArrayLike = np.inf

    @classmethod
    def from_colmap(
        cls, name: str, matrix: ArrayLike, translation: ArrayLike, sd: ArrayLike = np.inf
    ) -> Self:
        """Convert `sensor_from_rig` of COLMAP: R (3, 3) and t (3,), y down and z forward.

        A = F R' F and c = -F R' t with F = diag(1, -1, -1).
        """
        turned = rotations(f"matrix of sensor {name}", matrix).T
        flip = np.diag([1.0, -1.0, -1.0])
        value = -flip @ turned @ shaped(f"translation of sensor {name}", translation, (3,))
        return cls(name, value, flip @ turned @ flip, sd)


def _across(name: str, value: ArrayLike | None) -> Floats:
    """Return axes with the third one along a direction."""
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
    """Return each unknown once, in order; reject repeated names within a type."""
    distinct = list({id(each): each for each in unknowns}.values())
    titles: set[str] = set()
    for each in distinct:
        if each.title in titles:
            raise InputError(phrase("block.repeated-object", kind="unknown", name=each.title))
        titles.add(each.title)
    return distinct
