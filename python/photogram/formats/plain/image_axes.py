"""Image coordinates of tables and of cameras: origin and axes."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.images import from_corner, in_corner, known_size
from photogram.formats.plain.settings import Settings
from photogram.formats.project import Size
from photogram.network.cameras import Camera

__all__ = ["from_tables", "in_unit", "to_tables"]


def in_unit(settings: Settings, xy: Floats, *, pixels: bool) -> Floats:
    """Return (m, 2) image coordinates in the unit of cameras; pixels count from the corner of the first.

    `pixels` says that they are pixels: columns and rows, or samples and lines of scanners.
    """
    found = xy * 1e-3 if settings.image == "um" and not pixels else xy
    return found + 0.5 if pixels and settings.pixel_origin == "center" else found


def from_tables(settings: Settings, camera: Camera, size: Size | None, xy: Floats) -> Floats:
    """Return (m, 2) image coordinates along the axes of a camera, from those that tables have in its unit.

    Raises
    ------
    InputError
        A camera whose pictures have no known size, and must have.
    """
    if settings.image == "px" and settings.image_y == "down":
        return from_corner(camera, size, xy)
    if settings.image == "px" and camera.image_y == "down":
        width, height = known_size(camera, size)
        return np.column_stack([width / 2 + xy[:, 0], height / 2 - xy[:, 1]])
    return xy if camera.image_y == settings.image_y else xy * [1.0, -1.0]


def to_tables(image_y: str, camera: Camera, size: Size | None, xy: Floats) -> Floats:
    """Return (m, 2) image coordinates as tables have them whose `[axes] image_y` this is.

    Raises
    ------
    InputError
        A camera in pixels that counts from the corner among such as count from the middle, or whose pictures
        have no known size.
    """
    if camera.unit == "px" and image_y == "down":
        return in_corner(camera, size, xy)
    return xy if camera.image_y == image_y else xy * [1.0, -1.0]
