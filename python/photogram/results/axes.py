"""The components of what a block has, their units, and the units in which people read their differences."""

from __future__ import annotations

from photogram.network.block import Block
from photogram.show.quantity import Axis

TURNS = tuple(Axis.turned(name, "deg") for name in ("omega", "phi", "kappa"))
"""Of attitudes."""


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
