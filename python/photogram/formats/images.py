"""Image coordinates of files and of cameras: pixels from the corner, or what a model counts in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.project import Project, Size
from photogram.network.cameras import Camera

__all__ = ["from_corner", "in_corner", "known_size", "sizes_of", "to_corner"]


def from_corner(camera: Camera, size: Size | None, corner: Floats) -> Floats:
    """Return (m, 2) image coordinates of a camera in pixels from columns and rows from the upper-left corner.

    Models that count y upwards count from the middle of the picture.

    Raises
    ------
    InputError
        Such a camera whose pictures have no known size.
    """
    if camera.image_y == "down":
        return corner
    width, height = known_size(camera, size)
    found: Floats = np.column_stack([corner[:, 0] - width / 2, height / 2 - corner[:, 1]])
    return found


def in_corner(camera: Camera, size: Size | None, xy: Floats) -> Floats:
    """Return (m, 2) columns and rows from the upper-left corner, of image coordinates of a camera in pixels.

    Raises
    ------
    InputError
        A camera that counts from the middle of its pictures, whose size is not known.
    """
    if camera.image_y == "down":
        return xy
    width, height = known_size(camera, size)
    return np.column_stack([xy[:, 0] + width / 2, height / 2 - xy[:, 1]])


def to_corner(project: Project) -> Floats:
    """Return (m, 2) columns and rows from the upper-left corner, pixels.

    Raises
    ------
    InputError
        Images in millimetres, a camera whose pictures have no known size.
    """
    block = project.block
    if block.image_unit != "px" or block.photo_cameras is None:
        raise InputError("images are in millimetres: they have no columns and rows")
    found = block.image_xy.copy()
    cameras = block.photo_cameras[block.image_photos]
    for row, camera in enumerate(block.cameras):
        own = cameras == row
        found[own] = in_corner(camera, project.sizes[row], found[own])
    return found


def known_size(camera: Camera, size: Size | None) -> Size:
    """Return the size of the pictures of a camera.

    Raises
    ------
    InputError
        It is not known.
    """
    if size is None:
        raise InputError(f"the size of the pictures of the camera {camera.title} is not known")
    return size


def sizes_of(project: Project) -> Sequence[Size]:
    """Return width and height of the pictures of each camera.

    Raises
    ------
    InputError
        One that is not known.
    """
    return [known_size(each, size) for each, size in zip(project.block.cameras, project.sizes, strict=True)]
