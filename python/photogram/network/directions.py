"""Directions of image rays in the axes of the photos."""

from __future__ import annotations

import numpy as np

from photogram.arguments.arrays import rows_of_each
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.network.block import Block
from photogram.network.cameras import rays_of_row
from photogram.network.motion import focal_images, scanners
from photogram.network.subset import image_rows, kept_images
from photogram.words import phrase

_SIDE = -0.02  # Maximum u3 of unit directions that are clearly in front of the camera
_SMALL = 1e-6  # Radians off the axis with negligible distortion


def image_directions(block: Block) -> Floats:
    """Return (m, 3) unit directions of the images of a block; NaN if undefined.

    The axes of a moving photo refer to the time of the image: x right, y up, z back. The camera looks along
    -z. Refraction is ignored.
    """
    cameras, photo_cameras = block.core_cameras()
    images = rows_of_each(photo_cameras[block.image_photos], len(cameras))
    directions, places = np.full((len(block.image_photos), 3), np.nan), focal_images(block)
    for row, own in zip(cameras, images, strict=True):
        directions[own] = rays_of_row(row, places[own])
    return directions


def seen_without_lenses(block: Block) -> tuple[Block, Bools]:
    """Convert a block to cameras without distortion; return also (m,) the images that it contains.

    Cameras are in the unit of the images. A block with principal distances is returned unchanged. If most
    directions are undefined (e.g. in another unit), lenses are ignored and cameras are linear. Otherwise
    images without a direction in front of the camera are removed. Scanner images are always removed, because
    they have varying poses. Trajectories are removed as well.
    """
    pictured: Bools = ~scanners(block)[block.image_photos]
    if not block.cameras or block.photo_cameras is None:
        plain = block.replace(timed=()) if block.timed else block
        return kept_images(plain, pictured) if not pictured.all() else plain, pictured
    directions = image_directions(block)
    seen = (directions[:, 2] < _SIDE) & pictured
    if 2 * np.count_nonzero(seen) < np.count_nonzero(pictured):
        # Tangents -u1/u3, -u2/u3 of cameras that have their scale near the axis everywhere.
        tangents, seen = np.empty_like(block.image_xy), pictured
        image_cameras = block.photo_cameras[block.image_photos]
        for row, camera in enumerate(block.cameras):
            middle, right, up = camera.project([[0.0, 0.0, -1.0], [_SMALL, 0.0, -1.0], [0.0, _SMALL, -1.0]])
            linear = np.column_stack([right - middle, up - middle]) / _SMALL
            if not abs(np.linalg.det(linear)) > 0:
                raise InputError(phrase("camera.no-scale", camera=camera.name))
            of_camera = image_cameras == row
            tangents[of_camera] = np.linalg.solve(linear, (block.image_xy[of_camera] - middle).T).T
    else:
        tangents = -directions[:, :2] / directions[:, 2:]
    scales = block.camera_scales()
    plain = block.replace(
        timed=(),
        cameras=(),
        photo_cameras=None,
        principal_distances=-scales,
        **image_rows(block, seen) | {"image_xy": (scales[block.image_photos, np.newaxis] * tangents)[seen]},
    )
    return plain, seen


def direction_deviations(block: Block) -> Floats:
    """Return (m,) standard deviations of directions, radians: image sd / principal distance."""
    deviations = np.sqrt((block.image_sd**2).mean(axis=1)) / block.camera_scales()[block.image_photos]
    return np.asarray(deviations)
