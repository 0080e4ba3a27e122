"""Parts of a block: selected photos and images; photos on trajectories, their image times and poses.

A frame photo, or a rolling-shutter photo, has nearly the same pose for all its images. A scanner has a
different pose for each line, and its coordinates are samples and lines. Functions that assume one pose per
photo do not apply to scanners.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import numpy as np

from photogram.arguments.arrays import frozen, rows_of_each
from photogram.arguments.types import Bools, Floats, Indices
from photogram.network.block import Block, flown_by
from photogram.network.block_checks import rows_of
from photogram.network.film_reduction import camera_images
from photogram.network.moving_photos import Timed
from photogram.network.observations import Observation, Smoothness
from photogram.network.trajectories import Trajectory

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


def timed_photos(block: Block) -> Bools:
    return _named(block, {each.photo for each in block.timed})


def on_shared(block: Block) -> Bools:
    """Return (P,) whether photos are on a given trajectory; their own poses are approximate."""
    return _named(block, {each.photo for each in block.timed if each.trajectory is not None})


def scanners(block: Block) -> Bools:
    return _named(block, {each.photo for each in block.timed if each.lines is not None})


def _named(block: Block, names: set[str]) -> Bools:
    if not names:
        return np.zeros(len(block.photo_ids), dtype=bool)
    return np.array([name in names for name in block.photo_ids], dtype=bool)


class Given(Protocol):
    """Photos, points and image observations to adjust together: members that blocks and collections share."""

    @property
    def photo_ids(self) -> list[str]: ...

    @property
    def point_ids(self) -> list[str]: ...

    @property
    def point_positions(self) -> Floats: ...

    @property
    def point_sd(self) -> Floats: ...

    @property
    def image_photos(self) -> Indices: ...

    @property
    def image_points(self) -> Indices: ...

    @property
    def image_xy(self) -> Floats: ...

    @property
    def image_sd(self) -> Floats: ...

    @property
    def observations(self) -> Sequence[Observation]: ...

    @property
    def image_unit(self) -> str: ...

    @property
    def geographic(self) -> bool: ...


def focal_images(network: Given) -> Floats:
    """Return (m, 2) image coordinates in the focal plane, in which residuals are computed.

    Scanner images are converted to sample positions, film readings to the camera frame.
    """
    if not isinstance(network, Block):
        return network.image_xy
    block = network
    found = camera_images(block)
    for each, _, _, own in timed_images(block):
        if each.lines is not None:
            found = found.copy() if found is block.image_xy else found
            found[own] = each.images(block.image_xy[own])[2]
    return found


def of_pictures(block: Block) -> Block:
    """Remove the images of scanners, so that each photo has about one pose."""
    scanned = scanners(block)
    return kept_images(block, ~scanned[block.image_photos]) if scanned.any() else block


def at_rest(block: Block) -> Block:
    """Return the part of a block without trajectories: photos at rest and their observations."""
    if not flown_by(block):
        return block
    observations = [
        each for each in block.observations if each.moment is None and not isinstance(each, Smoothness)
    ]
    timed = timed_photos(block)
    return of_photos(block.replace(timed=(), observations=observations), ~timed)


def timed_images(block: Block) -> Iterator[tuple[Timed, Trajectory, int, Indices]]:
    """Yield timed photos with their trajectory, index and image indices."""
    if not block.timed:
        return
    rows, images = block._photo_rows, rows_of_each(block.image_photos, len(block.photo_ids))
    for own, trajectory in zip(block.timed, block.trajectories, strict=True):
        yield own, trajectory, rows[own.photo], images[rows[own.photo]]


def about(trajectory: Trajectory, time: float) -> tuple[Floats, Floats]:
    """Return the pose of a trajectory at a time, with the given corrections.

    The result is (3,) X, Y, Z, geocentric if the object space is geographic, and (3, 3) the axes of the
    photo. Beyond the ends of the trajectory, the pose is constant.
    """
    places, matrices = given_poses(trajectory, np.clip([time], *trajectory.reach))
    return places[0], matrices[0]


def given_poses(trajectory: Trajectory, times: Floats) -> tuple[Floats, Floats]:
    """Return (n, 3) positions and (n, 3, 3) axes at (n,) times within reach, as :func:`about`."""
    position, rotation = (np.array([each.position for each in own]) for own in trajectory.coefficients)
    places, matrices, *_ = trajectory.flown(times, position, rotation)
    return places, matrices.reshape(-1, 3, 3)
