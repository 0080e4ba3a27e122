"""Image coordinates of files and of cameras: pixels from the corner, or what a model counts in.

What needs the size of the pictures of a camera, and does not know it, is an :class:`photogram.InputError`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.plain.settings import Settings
from photogram.formats.project import Project, Size
from photogram.io.places import Failing
from photogram.io.units import scaled
from photogram.network.cameras import Camera
from photogram.words import phrase


def by_camera(xy: Floats, which: Indices, convert: Callable[[int, Floats], Floats]) -> Floats:
    """Return (m, 2) image coordinates of which those of each camera are converted by themselves.

    `xy`: (m, 2) image coordinates; `which`: (m,) the camera of each, by its row; -1: it stays as it is.
    """
    found = xy.copy()
    for row in np.unique(which[which >= 0]).tolist():
        own = which == row
        found[own] = convert(row, xy[own])
    return found


def from_corner(camera: Camera, size: Size | None, corner: Floats) -> Floats:
    """Return (m, 2) image coordinates of a camera in pixels from columns and rows from the upper-left corner.

    Models that count y upwards count from the middle of the picture.
    """
    if camera.image_y == "down":
        return corner
    width, height = known_size(camera, size)
    found: Floats = np.column_stack([corner[:, 0] - width / 2, height / 2 - corner[:, 1]])
    return found


def in_corner(camera: Camera, size: Size | None, xy: Floats) -> Floats:
    """Return (m, 2) columns and rows from the upper-left corner, of image coordinates in pixels."""
    if camera.image_y == "down":
        return xy
    width, height = known_size(camera, size)
    return np.column_stack([xy[:, 0] + width / 2, height / 2 - xy[:, 1]])


def to_corner(project: Project) -> Floats:
    """Return (m, 2) columns and rows from the upper-left corner, pixels; images in millimetres have none."""
    block = project.block
    if block.image_unit != "px" or block.photo_cameras is None:
        raise InputError(phrase("format.pixels"))
    which = block.photo_cameras[block.image_photos]
    return by_camera(
        block.image_xy, which, lambda row, own: in_corner(block.cameras[row], project.sizes[row], own)
    )


def known_size(camera: Camera, size: Size | None) -> Size:
    """Return the size of the pictures of a camera."""
    if size is None:
        raise InputError(phrase("format.image-size", camera=camera.title))
    return size


def sizes_of(project: Project) -> Sequence[Size]:
    """Return width and height of the pictures of each camera."""
    return [known_size(each, size) for each, size in zip(project.block.cameras, project.sizes, strict=True)]


def in_unit(settings: Settings, xy: Floats, *, pixels: bool) -> Floats:
    """Return (m, 2) image coordinates in the unit of cameras; pixels count from the corner of the first.

    `pixels` says that they are pixels: columns and rows, or samples and lines of scanners.
    """
    found = scaled(xy, 1e-3) if settings.image == "um" and not pixels else xy
    return found + 0.5 if pixels and settings.pixel_origin == "center" else found


def from_tables(settings: Settings, camera: Camera, size: Size | None, xy: Floats) -> Floats:
    """Return (m, 2) image coordinates along the axes of a camera, from those that tables have in its unit."""
    if settings.image == "px" and settings.image_y == "down":
        return from_corner(camera, size, xy)
    if settings.image == "px" and camera.image_y == "down":
        width, height = known_size(camera, size)
        return np.column_stack([width / 2 + xy[:, 0], height / 2 - xy[:, 1]])
    return xy if camera.image_y == settings.image_y else xy * [1.0, -1.0]


def to_tables(image_y: str, camera: Camera, size: Size | None, xy: Floats) -> Floats:
    """Return (m, 2) image coordinates as tables have them whose `[axes] image_y` this is."""
    if camera.unit == "px" and image_y == "down":
        return in_corner(camera, size, xy)
    return xy if camera.image_y == image_y else xy * [1.0, -1.0]


Y_DOWN: Floats = np.diag([1.0, -1.0, -1.0])
"""Carries vectors between axes x right, y up, z back and axes x right, y down, z forward."""


def is_rotation(matrix: Floats, tolerance: float = 1e-6) -> bool:
    """Whether a (3, 3) matrix is orthonormal, up to the digits that a file has, and not mirrored."""
    with np.errstate(over="ignore", invalid="ignore"):
        apart = np.abs(matrix @ matrix.T - np.eye(3)).max()
    return bool(apart < tolerance and np.linalg.det(matrix) > 0)


def checked_rotation(place: Failing, matrix: Floats) -> Floats:
    """Return a rotation matrix of a file, orthonormal to the last bits."""
    if not is_rotation(matrix):
        raise place.error(phrase("format.rotation"))
    found: Floats = matrix @ (3 * np.eye(3) - matrix.T @ matrix) / 2
    return found
