"""Simulated blocks photographed by other cameras: with distortion, in pixels, several of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.errors import InputError
from photogram.network.block import Block
from photogram.network.cameras import Camera, images_of
from photogram.network.photo_cameras import checked_cameras

__all__ = ["photographed"]


def photographed(
    truth: Block, block: Block, cameras: Sequence[Camera], start_cameras: Sequence[Camera] | None
) -> tuple[Block, Block]:
    """Let cameras take the photos of a simulated block in turn.

    The errors of image coordinates and their standard deviations are those of the block, as angles near the
    axis: in the unit of a camera they grow with its principal distance.

    Parameters
    ----------
    truth, block
        The block without errors and the one with them, both with one principal distance.
    cameras
        The true ones; the first photo has the first.
    start_cameras
        What is known of them: with these the block starts, and what is unknown of them is so there. None:
        they are known.

    Returns
    -------
    The two blocks with cameras.

    Raises
    ------
    InputError
        What are no cameras of one unit, another number of them to start with, a point that no image shows.
    """
    start = cameras if start_cameras is None else checked_cameras(start_cameras)
    if len(start) != len(cameras) or start[0].unit != cameras[0].unit:
        raise InputError("start_cameras are as many as cameras, and in their unit")
    distance = truth.known_distances("the simulation")[0]
    photo_cameras = np.arange(len(truth.photo_ids)) % len(cameras)
    of_images = photo_cameras[truth.image_photos]
    directions = np.column_stack([truth.image_xy, np.full(len(truth.image_xy), distance)])
    # The camera looks along -z, whatever the sign of the principal distance.
    images = images_of(cameras, of_images, -np.sign(distance) * directions)
    if not np.isfinite(images).all():
        name = cameras[of_images[np.flatnonzero(~np.isfinite(images).all(axis=1))[0]]].title
        raise InputError(f"the camera {name} has no image of some points: they are beyond its lens terms")
    larger = np.array([each.scale for each in cameras])[of_images, np.newaxis] / abs(distance)
    changes = {
        "principal_distances": None,
        "photo_cameras": photo_cameras,
        "image_sd": truth.image_sd * larger,
    }
    return (
        truth.replace(**changes, cameras=cameras, image_xy=images),
        block.replace(**changes, cameras=start, image_xy=images + larger * (block.image_xy - truth.image_xy)),
    )
