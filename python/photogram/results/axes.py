"""Names, components and units of parts of networks, and display units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.block import Block
from photogram.network.geometry import geographic_to_geocentric, lengths_of_units
from photogram.network.motion import scanners
from photogram.results.observation_kinds import ObservedKind
from photogram.show.quantity import Axis, Quantity

if TYPE_CHECKING:
    from photogram import Result

TURNS = tuple(Axis.turned(name, "deg") for name in ("omega", "phi", "kappa"))  # Of attitudes


def point_axes(block: Block) -> tuple[Axis, ...]:
    """Return the axes of points and stations; geographic plan coordinates are angles."""
    unit = block.linear_unit
    if block.geographic:
        return Axis.turned("longitude", "dms"), Axis.turned("latitude", "dms"), Axis.of("height", unit)
    return tuple(Axis.of(name, unit) for name in "XYZ")


def image_axes(unit: str) -> tuple[Axis, ...]:
    """Return the axes of image coordinates; residuals in mm have micrometres."""
    small, factor = ("um", 1000.0) if unit == "mm" else (unit, 1.0)
    return tuple(Axis(name, unit, "", f"_{unit}", small, factor) for name in "xy")


def component_axis(name: str, unit: str) -> Axis:
    """Return the axis of a component; small rotations are displayed in seconds of arc."""
    return Axis.turned(name) if unit == "rad" else Axis.of(name, unit)


@dataclass(frozen=True, eq=False)
class Terms:
    """Names, axes and units of the photos, points and images of a network."""

    photos: np.ndarray  # (P,), (n,) names, or numbers from 0
    points: np.ndarray
    photo_axes: tuple[Axis, ...]  # Unknowns of a photo, coordinates of a point, image coordinates
    point_axes: tuple[Axis, ...]
    image_axes: tuple[Axis, ...]
    photo_values: Floats  # (P, k) adjusted unknowns
    # Unknowns of a photo: their name in texts, and their member in JSON documents
    layers: Mapping[str, slice]
    parts: Mapping[str, slice]
    of_photos: tuple[Quantity, ...] = ()  # First columns of the tables of photos and points
    of_points: tuple[Quantity, ...] = ()
    kinds: Iterable[ObservedKind] = ()  # Additional observations
    # (o,) rows of these in the block, in the order of the core
    observation_rows: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    lengths: Floats | None = None  # (3,) length units of coordinates if plan coordinates are angles
    linear_unit: str = ""
    split: bool = False  # Whether JSON documents separate differences of positions and attitudes

    @property
    def identity(self) -> str:
        """The member of JSON documents for the name or number of an item."""
        return "number" if self.points.dtype.kind == "i" else "id"


@dataclass(frozen=True, eq=False)
class Determined:
    """Positions of the points and photos of an adjusted network, with cofactors."""

    stations: Floats  # (P, 3), (n, 3) positions in axes of equal units
    points: Floats
    poses: Floats  # (P, 6, 6) cofactors of position and attitude
    ranks: Indices  # (P,) numbers of pose unknowns that are not fixed
    point_cofactors: Floats  # (n, 3, 3) with axes of equal units
    # (P,) photos of scanners, which have a separate station for each line; None without any
    moving: Bools | None = None


def block_terms(result: Result) -> Terms:
    """Return the terms of a block."""
    block, axes = result.block, point_axes(result.block)
    point_kinds = result.point_kinds[result.used_points]
    lengths = None
    if block.geographic and len(result.photo_positions):
        lengths = lengths_of_units(result.photo_positions.mean(axis=0, keepdims=True), block.spheroid)[0]
    return Terms(
        photos=np.array(block.photo_ids, dtype=object),
        points=np.array(block.point_ids, dtype=object),
        photo_axes=(*axes, *TURNS),
        point_axes=axes,
        image_axes=image_axes(block.image_unit),
        photo_values=np.hstack([result.photo_positions, result.photo_attitudes]),
        layers={"Positions": slice(0, 3), "Attitudes": slice(3, 6)},
        parts={"position": slice(0, 3), "attitude_rad": slice(3, 6)},
        of_points=(Quantity(point_kinds, (), "name", "kind", "kind", "what it is", "Kind"),),
        kinds=tuple(result.kinds.values()),
        observation_rows=np.array(block.observations.core_order, dtype=np.int64),
        lengths=lengths,
        linear_unit=block.linear_unit,
        split=True,
    )


def determined(result: Result) -> Determined:
    """Return positions and poses of a block with cofactors, geocentric if geographic."""
    block, points, stations = result.block, result.point_positions, result.photo_positions
    cofactors = result.point_cofactors
    if block.spheroid is not None:
        units = lengths_of_units(points, block.spheroid)
        cofactors = cofactors * units[:, :, np.newaxis] * units[:, np.newaxis, :]
        points, stations = (
            geographic_to_geocentric(np.array(each), block.spheroid) for each in (points, stations)
        )
    poses = result.photo_cofactors[:, :6, :6]
    ranks = (np.diagonal(poses, axis1=1, axis2=2) > 0).sum(axis=1)
    return Determined(stations, points, poses, ranks, cofactors, scanners(block))
