"""Projects in millimetres, or with principal distances alone, as formats of pixels hold them."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.plain.writing import known_cameras
from photogram.formats.project import Project, Size
from photogram.network.cameras import Camera
from photogram.network.motion import scanners

__all__ = ["in_pixels", "nominal_pixels"]

NOMINAL_MM = 0.01
"""Side of a pixel where nothing says how large they are: rays are the same."""
ROUND = 100
"""Pixels: to whole ones of these go widths and heights that nothing says."""


def in_pixels(project: Project) -> Project:
    """Return a project with the same rays whose cameras are given, and count pixels.

    Millimetres are divided by the size of a pixel, or a nominal one; negative planes are turned by 180
    degrees into positive ones. Pictures whose size is not known get one that holds all images, where
    coordinates do not count from their corners. Rolling shutters, whose rows count as images did, stay
    behind.

    Raises
    ------
    InputError
        Photos of a scanner, which are no pictures.
    """
    block = project.block
    if (strips := np.flatnonzero(scanners(block))).size:
        raise InputError(
            f"the photo {block.photo_ids[int(strips[0])]} is of a line scanner, and has no pixels"
        )
    given = block.image_unit == "px"
    if given and not _unsized(project):
        return project
    cameras, which = known_cameras(block)
    of_images = np.asarray(which, dtype=np.int64)[block.image_photos]
    none = (None,) * len(cameras)
    pixels = [each or (None if given else NOMINAL_MM) for each in project.pixel_mm or none]
    xy, sd = block.image_xy.copy(), block.image_sd.copy()
    made, sizes = [], []
    for row, (camera, pixel, size) in enumerate(zip(cameras, pixels, project.sizes or none, strict=True)):
        own = of_images == row
        scale = 1.0 if given or pixel is None else 1.0 / pixel
        negative = camera.model == "perspective" and camera.parameters["c"] > 0
        xy[own] *= -scale if negative else scale
        sd[own] *= scale
        made.append(_camera(camera, scale, negative))
        sizes.append(_size(camera, xy[own]) if size is None and _is_free(camera) else size)
    return project.replace(
        block=block.replace(
            cameras=made,
            photo_cameras=which,
            principal_distances=None,
            image_xy=xy,
            image_sd=sd,
            timed=(),
        ),
        sizes=tuple(sizes),
        pixel_mm=tuple(pixels),
    )


def nominal_pixels(project: Project) -> list[str]:
    """Return what is to be said of a project whose pixels, or sizes of pictures, are nominal."""
    found = []
    if project.block.image_unit == "mm" and None in (project.pixel_mm or (None,)):
        found.append(
            f"millimetres: pixels, whose size is not known, are taken as {NOMINAL_MM:g} mm; rays are the same"
        )
    if _unsized(project):
        found.append("that the size of pictures is not known: they are as large as their images")
    return found


def _unsized(project: Project) -> bool:
    """Return whether pictures have no known size, and any will do."""
    cameras, _ = known_cameras(project.block)
    sizes = project.sizes or (None,) * len(cameras)
    return any(size is None and _is_free(each) for each, size in zip(cameras, sizes, strict=True))


def _is_free(camera: Camera) -> bool:
    """Return whether no coordinate depends on the size of a picture: they count from the middle or are mm."""
    return camera.image_y == "up" or camera.unit == "mm"


def _camera(camera: Camera, scale: float, negative: bool) -> Camera:
    powers = camera.powers
    factors = {name: (-1.0 if negative else 1.0) * scale ** powers[name] for name in camera.names}
    covariance = None
    if camera.covariance is not None:
        names, matrix = camera.covariance
        own = np.array([factors[name] for name in names])
        covariance = (names, np.asarray(matrix) * np.outer(own, own))
    deviations = zip(camera.names, camera.deviations.tolist(), strict=True)
    return camera.replace(
        parameters={name: value * factors[name] for name, value in camera.parameters.items()},
        sd={name: own * abs(factors[name]) for name, own in deviations},
        covariance=covariance,
        unit="px",
    )


def _size(camera: Camera, xy: Floats) -> Size:
    """Return width and height of a picture that holds all images, about its middle where y goes up."""
    reach = np.abs(xy).max(axis=0, initial=1.0) * (2 if camera.image_y == "up" else 1)
    width, height = (ROUND * math.ceil(each / ROUND) for each in reach.tolist())
    return width, height
