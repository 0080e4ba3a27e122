"""A block of some of the photos of a block."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools
from photogram.network.block import Block

__all__ = ["of_photos"]

PHOTOS = (
    *("photo_positions", "photo_attitudes", "principal_distances", "photo_position_sd", "photo_attitude_sd"),
    *("photo_positions_observed", "photo_attitudes_observed", "photo_cameras"),
)
"""Arrays of a block with a row for each photo."""


def of_photos(block: Block, kept: Bools) -> Block:
    """Return a block of the (P,) photos that are kept, with their images and what was observed of them."""
    images = kept[block.image_photos]
    number = np.cumsum(kept) - 1
    names = [name for name, own in zip(block.photo_ids, kept.tolist(), strict=True) if own]
    there = set(names)
    return block.replace(
        photo_ids=names,
        observations=[each for each in block.observations if there.issuperset(each.photos)],
        mounts=[each for each in block.mounts if each.photo in there],
        image_photos=number[block.image_photos[images]],
        image_points=block.image_points[images],
        image_xy=block.image_xy[images],
        image_sd=block.image_sd[images],
        **{name: values[kept] for name in PHOTOS if (values := getattr(block, name)) is not None},
    )
