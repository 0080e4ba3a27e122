"""Datums of free networks: what is held, or what stays nearest to its given place (docs/datum.md)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from photogram.arguments.arrays import argument_error, names, number, text, truth_value
from photogram.arguments.objects import kind_error, require
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block, position_columns
from photogram.words import phrase

__all__ = [
    "DatumRow",
    "InnerConstraints",
    "MinimumConstraints",
    "check_datum",
    "datum_row",
    "minimum_row",
]

DatumRow = tuple[str, list[int], list[int], bool, list[int], float | None]
"""`inner` or `relative`, points, photos, whether scale counts, photos whose attitudes count, the radius."""


@dataclass(frozen=True)
class InnerConstraints:
    """Chosen points and photos together are as near as they come to their given places (Meissl 1969).

    Of all datums that the same points and photos carry, this one gives them the least sum of variances. What
    has no given place is compared with the place where it started from.

    Parameters
    ----------
    points
        Names of points; None for all that take part.
    photos
        Names of photos, whose positions count; None for all. None that are on trajectories.
    scale
        Whether scale is taken from them, too, where nothing else gives one. Otherwise it stays as it is held.
    attitudes
        Names of photos whose attitudes count: a turn about an axis of the photo, times `radius`; None for
        all.
    radius
        What makes turns in radians comparable with shifts, in the linear unit. None: the root mean square
        distance of all points and photos from their middle.

    Raises
    ------
    InputError
        Names that are none, a radius that is not positive.
    """

    points: Sequence[str] | None = None
    photos: Sequence[str] | None = ()
    scale: bool = True
    attitudes: Sequence[str] | None = ()
    radius: float | None = None

    def __post_init__(self) -> None:
        for name in ("points", "photos", "attitudes"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, tuple(names(name, value)))
        truth_value("scale", self.scale)
        if self.radius is not None:
            require(0 < number("radius", self.radius) < math.inf, "radius", "positive", value=self.radius)


@dataclass(frozen=True)
class MinimumConstraints:
    """What is held at its initial values where nothing else gives a datum.

    Parameters
    ----------
    photo
        The photo whose position and attitude are held; None for the one with most images. Of one on a
        trajectory these are the coefficients about its time: of polynomials the first, of splines the next.
    coordinate
        Photo and name of its coordinate (`X`, `Y`, `Z`, or `longitude`, `latitude`, `height`), held for the
        scale; None for the one in which a photo is farthest from the first.

    Raises
    ------
    InputError
        A coordinate without a photo to hold, or one that is no pair of names.
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
    """Refuse an argument that is not a datum."""
    if not isinstance(datum, InnerConstraints | MinimumConstraints | None):
        raise kind_error("datum", "InnerConstraints, MinimumConstraints or None", datum)


def datum_row(block: Block, datum: InnerConstraints) -> DatumRow:
    """Return inner constraints as the core knows them; InputError of what is not in the block."""
    points, photos = _indices(block, "point", datum.points), _indices(block, "photo", datum.photos)
    attitudes = _indices(block, "photo", datum.attitudes)
    flown = {each.photo for each in block.timed}
    if on := [block.photo_ids[row] for row in (*photos, *attitudes) if block.photo_ids[row] in flown]:
        raise InputError(phrase("block.datum.moving", photo=on[0]))
    return "inner", points, photos, datum.scale, attitudes, datum.radius


def minimum_row(block: Block, datum: MinimumConstraints) -> tuple[int, tuple[int, int] | None] | None:
    """Return what is to be held as the core knows it; None where it is left to the core.

    InputError: a photo or coordinate that is not there.
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
    """Return the rows of photos or points, of all where none are named."""
    ids = block.photo_ids if kind == "photo" else block.point_ids
    if wanted is None:
        return list(range(len(ids)))
    index = {name: i for i, name in enumerate(ids)}
    if missing := [name for name in wanted if name not in index]:
        raise argument_error("datum", "absent", kind=kind, name=missing[0])
    return [index[name] for name in wanted]
