"""Subsets of a block: some of its photos or images."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.arrays import frozen
from photogram.arguments.types import Bools, Indices
from photogram.network.block import Block
from photogram.network.block_checks import rows_of
from photogram.network.observations import Observation, Smoothness

PHOTOS, IMAGES = (rows_of(Block, rows) for rows in ("photos", "images"))
"""Arrays of a block with a row for each photo, and for each image."""


def image_rows(network: object, kept: Indices | Bools) -> dict[str, Any]:
    """Return the image arrays of a block or collection by name, for some rows or a mask."""
    return {name: getattr(network, name)[kept] for name in IMAGES}


def kept_images(block: Block, kept: Indices | Bools) -> Block:
    """Return a block with some of its images, by unique rows or a mask; it remains valid."""
    own = block.kept()
    for name, values in image_rows(block, kept).items():
        object.__setattr__(own, name, frozen(values))
    return own


def with_rejected_points(block: Block, before: Block) -> Block:
    """Record the points that lost their last image observation since an earlier block."""
    lost = np.setdiff1d(before.image_points, block.image_points)
    names = {before.point_ids[row] for row in lost.tolist()}
    own = block.kept()
    object.__setattr__(own, "rejected_points", before.rejected_points | names)
    return own


def of_photos(block: Block, kept: Bools) -> Block:
    """Return a block of the photos `kept` (P,), with their images and observations."""
    fewer = kept_images(block, kept[block.image_photos])
    number = np.cumsum(kept) - 1
    names = [name for name, own in zip(block.photo_ids, kept.tolist(), strict=True) if own]
    there = set(names)
    return fewer.replace(
        photo_ids=names,
        observations=_observations(block, there),
        mounts=[each for each in block.mounts if each.photo in there],
        timed=[each for each in block.timed if each.photo in there],
        image_photos=number[fewer.image_photos],
        **{name: values[kept] for name in PHOTOS if (values := getattr(block, name)) is not None},
    )


def _observations(block: Block, there: set[str]) -> list[Observation]:
    """Return the observations of these photos and their trajectories."""
    own = [(each.photo in there, one) for each, one in zip(block.timed, block.trajectories, strict=True)]
    flown = {id(one) for kept, one in own if kept}
    left = [one for kept, one in own if not kept and id(one) not in flown]
    trajectories = {id(each) for each in left}
    coefficients = {id(each) for one in left for all_ in one.coefficients for each in all_}

    def stays(each: Observation) -> bool:
        if each.moment is not None:
            return id(each.moment.trajectory) not in trajectories
        if isinstance(each, Smoothness):
            return not any(id(one) in coefficients for one in each.unknowns)
        return there.issuperset(each.photos)

    return [each for each in block.observations if stays(each)]
