"""Names and components of the parts of networks, their units, and the units of differences for people."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.block import Block
from photogram.results.observation_kinds import ObservedKind
from photogram.show.quantity import Axis, Quantity

TURNS = tuple(Axis.turned(name, "deg") for name in ("omega", "phi", "kappa"))  # Of attitudes


def point_axes(block: Block) -> tuple[Axis, ...]:
    """Return the three coordinates of points and stations: on the earth two of them are angles."""
    unit = block.linear_unit
    if block.geographic:
        return Axis.turned("longitude", "dms"), Axis.turned("latitude", "dms"), Axis.of("height", unit)
    return tuple(Axis.of(name, unit) for name in "XYZ")


def image_axes(unit: str) -> tuple[Axis, ...]:
    """Return the two image coordinates: residuals in millimetres are read in micrometres."""
    small, factor = ("um", 1000.0) if unit == "mm" else (unit, 1.0)
    return tuple(Axis(name, unit, "", f"_{unit}", small, factor) for name in "xy")


def component_axis(name: str, unit: str) -> Axis:
    """Return a component of an observation or unknown: small rotations are read in seconds of arc."""
    return Axis.turned(name) if unit == "rad" else Axis.of(name, unit)


@dataclass(frozen=True, eq=False)
class Terms:
    """What the photos, points and images of a network are called and measured in."""

    photos: np.ndarray  # (P,), (n,) names, or numbers from 0
    points: np.ndarray
    photo_axes: tuple[Axis, ...]  # Unknowns of a photo, coordinates of a point, image coordinates
    point_axes: tuple[Axis, ...]
    image_axes: tuple[Axis, ...]
    photo_values: Floats  # (P, k) adjusted unknowns
    # What the unknowns of a photo consist of: how people call it, and JSON documents
    layers: Mapping[str, slice]
    parts: Mapping[str, slice]
    of_photos: tuple[Quantity, ...] = ()  # What tables tell first: of photos, of points that took part
    of_points: tuple[Quantity, ...] = ()
    kinds: Iterable[ObservedKind] = ()  # Other observations than images
    # (o,) rows of these in the block, in the order of the core
    observation_rows: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    lengths: Floats | None = None  # (3,) of the units of coordinates, where two of them are angles
    linear_unit: str = ""
    split: bool = False  # Whether JSON documents tell differences of positions from those of attitudes

    @property
    def identity(self) -> str:
        """How JSON documents call the name or number of a thing."""
        return "number" if self.points.dtype.kind == "i" else "id"


@dataclass(frozen=True, eq=False)
class Determined:
    """Where the points and photos of an adjusted network are, and how well that is known."""

    stations: Floats  # (P, 3), (n, 3) places, with axes of equal units
    points: Floats
    poses: Floats  # (P, 6, 6) cofactors of position and attitude
    ranks: Indices  # (P,) how many unknowns of a pose are not fixed
    point_cofactors: Floats  # (n, 3, 3) with axes of equal units
    # (P,) which photos are no stations: scanners, of which each line is taken from another place; None
    # for none
    moving: Bools | None = None
