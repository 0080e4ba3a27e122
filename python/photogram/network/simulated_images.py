"""What cameras take of the ground of a simulated block: frames, then other cameras in their place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.cameras import Camera, images_of
from photogram.network.geometry import Spheroid
from photogram.network.refraction import Refraction
from photogram.network.simulated_layout import Layout, candidates, photo_ids
from photogram.network.simulated_motion import RollingShutter
from photogram.network.tables import checked_cameras
from photogram.words import phrase


@dataclass(frozen=True)
class Taken:
    """What cameras have taken of the ground: P photos with true poses, m images of points without errors.

    Poses of scanners are those in the middle of their images, which are samples and lines; `per_error` are
    (m, 2, 2) image coordinates by millimetres in the focal plane, None: these are the same. `true` and
    `given` are further arguments of the block: as they truly are, and as they are known.
    """

    photo_ids: list[str]
    positions: Floats
    attitudes: Floats
    image_photos: Indices
    image_points: Indices
    image_xy: Floats
    per_error: Floats | None = None
    true: dict[str, Any] = field(default_factory=dict)
    given: dict[str, Any] = field(default_factory=dict)

    def in_images(self, errors: Floats, images: Indices) -> Floats:
        """Return errors in image coordinates, of (k, 2) in the focal plane and the rows of their images."""
        if self.per_error is None:
            return errors
        return np.asarray(np.einsum("mij,mj->mi", self.per_error[images], errors))


def photograph(
    plan: Layout,
    ground: Floats,
    poses: tuple[Floats, Floats],
    principal_distance: float,
    frame_size: float,
    spheroid: Spheroid | None,
    photo_to_ground: bool,
    refraction: Refraction | None,
) -> Taken:
    """Take the ground, (n, 3) points of a grid, by frames of one side, in the unit of the principal distance.

    `poses` are (P, 3) positions and attitudes of the photos. Returned are images of points that are seen at
    least twice.
    """
    found = []
    positions, attitudes = poses
    for photos, points in candidates(plan):
        xy = geometry.project(
            ground[points],
            positions[photos],
            attitudes[photos],
            np.full(len(photos), principal_distance),
            spheroid=spheroid,
            photo_to_ground=photo_to_ground,
            refraction=refraction,
        )
        seen = (np.abs(xy) <= frame_size / 2).all(axis=1)
        found.append((photos[seen], points[seen], xy[seen]))
    photos, points, xy = (np.concatenate(each) for each in zip(*found, strict=True))
    seen = np.bincount(points)[points] >= 2
    return Taken(photo_ids(plan), positions, attitudes, photos[seen], points[seen], xy[seen])


def seen_side(
    frame_size: float,
    principal_distance: float,
    motion: RollingShutter | None,
    height: float,
    half_angle: float,
) -> float:
    """Return the side of the part of the frame whose images remain in it during the readout."""
    if motion is None:
        return frame_size
    side = frame_size - 2 * abs(principal_distance) * motion.margin(height, half_angle)
    if not side > frame_size / 2:
        raise InputError(phrase("simulation.readout"))
    return side


def photographed(
    truth: Block, block: Block, cameras: Sequence[Camera], start_cameras: Sequence[Camera] | None
) -> tuple[Block, Block]:
    """Let cameras take the photos of a simulated block in turn; return truth and block with cameras.

    The two have one principal distance. The errors of image coordinates and their standard deviations are
    those of the block, as angles near the axis: in the unit of a camera they grow with its principal
    distance. With `start_cameras` the block starts, and what is unknown of them is so there; None: they are
    known. InputError: what are no cameras of one unit, another number of them to start with, a point that no
    image shows.
    """
    start = cameras if start_cameras is None else checked_cameras(start_cameras)
    if len(start) != len(cameras) or start[0].unit != cameras[0].unit:
        raise InputError(phrase("simulation.start-cameras", n=len(cameras), unit=cameras[0].unit))
    distance = truth.known_distances("the simulation")[0]
    photo_cameras = np.arange(len(truth.photo_ids)) % len(cameras)
    of_images = photo_cameras[truth.image_photos]
    directions = np.column_stack([truth.image_xy, np.full(len(truth.image_xy), distance)])
    # The camera looks along -z, whatever the sign of the principal distance.
    images = images_of(cameras, of_images, -np.sign(distance) * directions)
    if not np.isfinite(images).all():
        name = cameras[of_images[np.flatnonzero(~np.isfinite(images).all(axis=1))[0]]].title
        raise InputError(phrase("simulation.beyond-lens", camera=name))
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
