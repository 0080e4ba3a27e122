"""Where the rays of a block's images come from: directions in the axes of the photos."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.network.block import Block
from photogram.network.cameras import rays_of_row
from photogram.network.motion import focal_images, scanners
from photogram.network.subset import image_rows, kept_images
from photogram.words import phrase

_SIDE = -0.02  # u3 of unit directions that are seen well in front of the camera
_SMALL = 1e-6  # Radians off the axis, where no lens distorts


def image_directions(block: Block) -> Floats:
    """(m, 3) unit directions of the images of a block in the axes of their photos; NaN where there is none.

    Of photos that move these are the axes at the time of the image. x to the right, y up, z back: the camera
    looks along -z. Refraction is left out.
    """
    cameras, photo_cameras = block.core_cameras()
    of_images = photo_cameras[block.image_photos]
    order = np.argsort(of_images, kind="stable")
    ends = np.searchsorted(of_images[order], np.arange(len(cameras)), side="right")
    directions, places = np.full((len(order), 3), np.nan), focal_images(block)
    for row, own in zip(cameras, np.split(order, ends[:-1]), strict=True):
        directions[own] = rays_of_row(row, places[own])
    return directions


def without_lenses(block: Block) -> Block:
    """Return a block as cameras without distortion would have seen it, in the unit of its images.

    A block that has principal distances is returned as it is. Where most images have no direction (they may
    be in another unit) lenses are left out, and cameras are everywhere what they are near the axis; else
    images without a direction in front of the camera are left out. So are those of scanners, which are no
    pictures with one pose, and nothing moves.
    """
    return seen_without_lenses(block)[0]


def seen_without_lenses(block: Block) -> tuple[Block, Bools]:
    """Return the block of :func:`without_lenses`, and (m,) which of the images it has."""
    pictured: Bools = ~scanners(block)[block.image_photos]
    if not block.cameras or block.photo_cameras is None:
        plain = block.replace(timed=()) if block.timed else block
        return kept_images(plain, pictured) if not pictured.all() else plain, pictured
    directions = image_directions(block)
    seen = (directions[:, 2] < _SIDE) & pictured
    if 2 * np.count_nonzero(seen) < np.count_nonzero(pictured):
        # The tangents -u1/u3, -u2/u3 as if cameras were everywhere what they are near the axis.
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
    """(m,) standard deviations of these directions, radians: those of images over the principal distance."""
    deviations = np.sqrt((block.image_sd**2).mean(axis=1)) / block.camera_scales()[block.image_photos]
    return np.asarray(deviations)
