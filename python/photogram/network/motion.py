"""Photos and records on trajectories: which these are, where and when their images are, also for the core.

A frame, and a photo with a rolling shutter, has nearly the pose that is its own at all of its images. A
scanner has another at each line, and samples and lines for coordinates: of what takes photos for pictures
with one pose nothing holds for it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.network.block import Block, flown_by
from photogram.network.film_reduction import camera_images
from photogram.network.moving_photos import Timed
from photogram.network.observations import Smoothness
from photogram.network.subset import kept_images, of_photos
from photogram.network.trajectories import Trajectory
from photogram.network.unadjusted import Given


def timed_photos(block: Block) -> Bools:
    """(P,) which photos are on trajectories."""
    return _named(block, {each.photo for each in block.timed})


def on_shared(block: Block) -> Bools:
    """(P,) which photos are on a trajectory that is given: their poses only tell where they are about."""
    return _named(block, {each.photo for each in block.timed if each.trajectory is not None})


def scanners(block: Block) -> Bools:
    """(P,) which photos are strips of a scanner, line by line."""
    return _named(block, {each.photo for each in block.timed if each.lines is not None})


def _named(block: Block, names: set[str]) -> Bools:
    if not names:
        return np.zeros(len(block.photo_ids), dtype=bool)
    return np.array([name in names for name in block.photo_ids], dtype=bool)


def focal_images(network: Given) -> Floats:
    """(m, 2) image coordinates in the focal plane, where residuals are: of scanners those of samples.

    Of scanned films those of the camera, in whose frame films and marks are given.
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
    """Return a block without the images of scanners: its photos are pictures, each with about one pose."""
    scanned = scanners(block)
    return kept_images(block, ~scanned[block.image_photos]) if scanned.any() else block


def at_rest(block: Block) -> Block:
    """Return what of a block is on no trajectory: photos with poses of their own, and what is of these."""
    if not flown_by(block):
        return block
    observations = [
        each for each in block.observations if each.moment is None and not isinstance(each, Smoothness)
    ]
    timed = timed_photos(block)
    return of_photos(block.replace(timed=(), observations=observations), ~timed)


def timed_images(block: Block) -> Iterator[tuple[Timed, Trajectory, int, Indices]]:
    """Return the timed photos of a block: each with its trajectory, its index, and those of its images."""
    if not block.timed:
        return
    rows = {name: row for row, name in enumerate(block.photo_ids)}
    order = np.argsort(block.image_photos, kind="stable")
    ends = np.searchsorted(block.image_photos[order], np.arange(len(rows)), side="right")
    starts = np.append(0, ends)
    for own, trajectory in zip(block.timed, block.trajectories, strict=True):
        row = rows[own.photo]
        yield own, trajectory, row, order[starts[row] : ends[row]]


def about(trajectory: Trajectory, time: float) -> tuple[Floats, Floats]:
    """Return the pose of a trajectory at a time by what is given of its corrections.

    Beyond what it reaches the pose is that of its end: (3,) X, Y, Z, geocentric where the object space is
    geographic, and (3, 3) the axes of the photo in these.
    """
    places, matrices = given_poses(trajectory, np.clip([time], *trajectory.reach))
    return places[0], matrices[0]


def given_poses(trajectory: Trajectory, times: Floats) -> tuple[Floats, Floats]:
    """Return (n, 3) places and (n, 3, 3) axes at (n,) times that the trajectory reaches, as :func:`about`."""
    position, rotation = (np.array([each.position for each in own]) for own in trajectory.coefficients)
    places, matrices, *_ = trajectory.flown(times, position, rotation)
    return places, matrices.reshape(-1, 3, 3)
