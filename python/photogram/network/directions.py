"""Where the rays of a block's images come from: directions in the axes of the photos."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.network.block import Block

__all__ = ["direction_deviations", "image_directions", "without_lenses"]


def image_directions(block: Block) -> Floats:
    """(m, 3) unit directions of the images of a block in the axes of their photos; NaN where there is none.

    x to the right, y up, z back: the camera looks along -z. Refraction is left out.
    """
    cameras, photo_cameras = block.core_cameras()
    of_images = photo_cameras[block.image_photos]
    order = np.argsort(of_images, kind="stable")
    ends = np.searchsorted(of_images[order], np.arange(len(cameras)), side="right")
    directions = np.full((len(order), 3), np.nan)
    for (model, parameters, *_), own in zip(cameras, np.split(order, ends[:-1]), strict=True):
        directions[own] = _photocore.camera_rays(model, np.array(parameters), block.image_xy[own])
    return directions


def direction_deviations(block: Block) -> Floats:
    """(m,) standard deviations of these directions, radians: those of images over the principal distance."""
    deviations = np.sqrt((block.image_sd**2).mean(axis=1)) / block.camera_scales()[block.image_photos]
    return np.asarray(deviations)


def without_lenses(block: Block) -> Block:
    """Return a block as cameras without distortion would have seen it, each with its given parameters.

    Images that no direction has, at these parameters, are left out.
    """
    if not block.cameras:
        return block
    directions, scales = image_directions(block), block.camera_scales()
    seen = np.isfinite(directions).all(axis=1)
    photos = block.image_photos[seen]
    ideal = directions[seen, :2] / -directions[seen, 2:]
    return block.replace(
        cameras=(),
        photo_cameras=None,
        principal_distances=-scales,
        image_photos=photos,
        image_points=block.image_points[seen],
        image_xy=ideal * scales[photos, np.newaxis],
        image_sd=block.image_sd[seen],
    )
