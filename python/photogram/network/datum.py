"""Datums of free networks: minimum and inner constraints (docs/datum.md)."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.arguments.arrays import argument_error, names, text
from photogram.arguments.fields import check_fields, option
from photogram.arguments.objects import kind_error, require
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block, position_columns
from photogram.words import phrase

DatumRow = tuple[str, list[int], list[int], bool, list[int], float | None]
"""`inner` or `relative`, points, photos, use of scale, photos with attitudes, radius."""


@dataclass(frozen=True)
class InnerConstraints:
    """Inner constraints: minimal distance of selected points and photos from given positions.

    Of all datums defined by the same points and photos, this one has the least sum of variances (Meissl
    1969). If a given position is missing, the initial one is used.

    Parameters
    ----------
    points
        Names of points; None for all that are adjusted.
    photos
        Names of photos whose positions count; None for all. Photos on trajectories are not allowed.
    scale
        Whether these points and photos also define the scale, if nothing else does. Default True.
    attitudes
        Names of photos whose attitudes count: a rotation about an axis of the photo, times `radius`. None
        for all.
    radius
        Factor that makes rotations in radians comparable with translations, in the linear unit. None: the
        root mean square distance of all points and photos from their centre.

    Raises
    ------
    InputError
        If a name is invalid or the radius is not positive.
    """

    points: Sequence[str] | None = None
    photos: Sequence[str] | None = ()
    scale: bool = True
    attitudes: Sequence[str] | None = ()
    radius: float | None = option(None, 0, is_open=True)

    def __post_init__(self) -> None:
        for name in ("points", "photos", "attitudes"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, tuple(names(name, value)))
        check_fields(self)


@dataclass(frozen=True)
class MinimumConstraints:
    """Minimum constraints: initial values that are fixed if nothing else defines a datum.

    Parameters
    ----------
    photo
        Photo whose position and attitude are fixed; None for the photo with most observations. On a
        trajectory, coefficients near its time are fixed: the first of a polynomial, the nearest of a spline.
    coordinate
        Photo and name of its coordinate (`X`, `Y`, `Z`, or `longitude`, `latitude`, `height`), fixed to
        define the scale. None: the coordinate in which a photo is farthest from the first.

    Raises
    ------
    InputError
        If a coordinate is specified without a photo, or is not a pair of names.
    """

    photo: str | None = None
    coordinate: tuple[str, str] | None = None

    def __post_init__(self) -> None:
        if self.photo is not None:
            text("photo", self.photo)
        if self.coordinate is not None:
            require(self.photo is not None, "datum", "requires", name="coordinate", other="photo")
            pair = names("coordinate", self.coordinate)
            if len(pair) != 2:
                raise kind_error("coordinate", "a photo and an axis", self.coordinate)
            object.__setattr__(self, "coordinate", (pair[0], pair[1]))


def check_datum(datum: object) -> None:
    if not isinstance(datum, InnerConstraints | MinimumConstraints | None):
        raise kind_error("datum", "InnerConstraints, MinimumConstraints or None", datum)


def datum_row(block: Block, datum: InnerConstraints) -> DatumRow:
    """Convert inner constraints to a row for the core; InputError if a name is not in the block."""
    points, photos = _indices(block, "point", datum.points), _indices(block, "photo", datum.photos)
    attitudes = _indices(block, "photo", datum.attitudes)
    flown = {each.photo for each in block.timed}
    if on := [block.photo_ids[row] for row in (*photos, *attitudes) if block.photo_ids[row] in flown]:
        raise InputError(phrase("block.datum.moving", photo=on[0]))
    return "inner", points, photos, datum.scale, attitudes, datum.radius


def minimum_row(block: Block, datum: MinimumConstraints) -> tuple[int, tuple[int, int] | None] | None:
    """Convert minimum constraints to indices for the core; None if the core selects them.

    InputError if a photo or coordinate does not exist.
    """
    if datum.photo is None:
        return None
    photo = _indices(block, "photo", [datum.photo])[0]
    if datum.coordinate is None:
        return photo, None
    other, axis = datum.coordinate
    axes = [name.removesuffix("_deg") for name in position_columns(block)]
    require(axis in axes, "datum", "unknown", kind="coordinate", name=axis, names=axes)
    for each, trajectory in zip(block.timed, block.trajectories, strict=True):
        if each.photo == other and (trajectory.position_axes != "table" or trajectory.body is not None):
            fields = {"axis": axis, "photo": other, "trajectory": trajectory.name}
            raise InputError(phrase("block.datum.axes", **fields))
    return photo, (_indices(block, "photo", [other])[0], axes.index(axis))


def _indices(block: Block, kind: str, wanted: Sequence[str] | None) -> list[int]:
    """Return the rows of named photos or points; all rows if `wanted` is None."""
    index = block._photo_rows if kind == "photo" else block._point_rows
    if wanted is None:
        return list(range(len(index)))
    if missing := [name for name in wanted if name not in index]:
        raise argument_error("datum", "absent", kind=kind, name=missing[0])
    return [index[name] for name in wanted]
