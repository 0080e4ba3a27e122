"""A block of some of the photos, or of the images, of a block."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Indices
from photogram.network.block import Block

__all__ = ["IMAGES", "PHOTOS", "kept_images", "of_photos"]

PHOTOS = (
    *("photo_positions", "photo_attitudes", "photo_position_sd", "photo_attitude_sd"),
    *("photo_positions_observed", "photo_attitudes_observed", "principal_distances", "photo_cameras"),
)
"""Arrays of a block with a row for each photo."""
IMAGES = ("image_photos", "image_points", "image_xy", "image_sd")
"""Those with a row for each image."""


def kept_images(block: Block, kept: Indices | Bools) -> Block:
    """Return a block with some of its images, by their rows or a mask."""
    return block.replace(**{name: getattr(block, name)[kept] for name in IMAGES})


def of_photos(block: Block, kept: Bools) -> Block:
    """Return a block of the (P,) photos that are kept, with their images and what was observed of them."""
    fewer = kept_images(block, kept[block.image_photos])
    number = np.cumsum(kept) - 1
    names = [name for name, own in zip(block.photo_ids, kept.tolist(), strict=True) if own]
    there = set(names)
    return fewer.replace(
        photo_ids=names,
        observations=[each for each in block.observations if there.issuperset(each.photos)],
        mounts=[each for each in block.mounts if each.photo in there],
        image_photos=number[fewer.image_photos],
        **{name: values[kept] for name in PHOTOS if (values := getattr(block, name)) is not None},
    )
