"""Images of the simulated ground by frame cameras, and by other cameras that replace them."""

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
from photogram.network.simulated_layout import Layout, candidates, photo_ids
from photogram.network.simulation_options import RollingShutter, SimulationOptions
from photogram.network.tables import checked_cameras
from photogram.words import phrase


@dataclass(frozen=True)
class Taken:
    """Images of the ground: P photos with true poses, m errorless image observations.

    The pose of a scanner refers to the mean time of its images, which are samples and lines. `per_error` (m,
    2, 2) converts millimetres in the focal plane to image coordinates; None: no conversion. `true` and
    `given` are further arguments of the block: true values, and values known to the adjustment.
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
        """Convert errors (k, 2) in the focal plane to image coordinates of the given image rows."""
        if self.per_error is None:
            return errors
        return np.asarray(np.einsum("mij,mj->mi", self.per_error[images], errors))


def photograph(
    plan: Layout, ground: Floats, poses: tuple[Floats, Floats], options: SimulationOptions, side: float
) -> Taken:
    """Project (n, 3) grid points into square frames with a side, in the unit of the principal distance.

    `poses` are (P, 3) positions and attitudes of the photos. Points with fewer than two images are removed.
    """
    found = []
    positions, attitudes = poses
    for photos, points in candidates(plan):
        xy = geometry.project(
            ground[points],
            positions[photos],
            attitudes[photos],
            np.full(len(photos), options.principal_distance),
            spheroid=options.spheroid,
            photo_to_ground=options.photo_to_ground,
            refraction=options.refraction,
        )
        seen = (np.abs(xy) <= side / 2).all(axis=1)
        found.append((photos[seen], points[seen], xy[seen]))
    photos, points, xy = (np.concatenate(each) for each in zip(*found, strict=True))
    seen = np.bincount(points)[points] >= 2
    return Taken(photo_ids(plan), positions, attitudes, photos[seen], points[seen], xy[seen])


def seen_side(options: SimulationOptions, motion: RollingShutter | None, half_angle: float) -> float:
    """Return the side of the part of the frame that images do not leave during the readout."""
    if motion is None:
        return options.frame_size
    margin = motion.margin(options.flying_height - options.relief, half_angle)
    side = options.frame_size - 2 * abs(options.principal_distance) * margin
    if not side > options.frame_size / 2:
        raise InputError(phrase("simulation.readout", share=(1 - side / options.frame_size) / 2))
    return side


def photographed(
    truth: Block, block: Block, cameras: Sequence[Camera], start_cameras: Sequence[Camera] | None
) -> tuple[Block, Block]:
    """Assign cameras cyclically to the photos of a simulated block; return truth and block.

    Truth and block must have the same principal distance. Errors and standard deviations of image coordinates
    are converted as angles near the axis. They are therefore proportional to the principal distance of a
    camera. `start_cameras` define the initial values and unknowns of the block; None: cameras are fixed.
    InputError if cameras have different units, numbers of cameras differ, or a point is not in any image.
    """
    start = cameras if start_cameras is None else checked_cameras(start_cameras)
    if len(start) != len(cameras) or start[0].unit != cameras[0].unit:
        fields = {"given": len(start), "units": sorted({str(each.unit) for each in start})}
        raise InputError(phrase("simulation.start-cameras", n=len(cameras), unit=cameras[0].unit, **fields))
    distance = truth.known_distances("the simulation")[0]
    photo_cameras = np.arange(len(truth.photo_ids)) % len(cameras)
    of_images = photo_cameras[truth.image_photos]
    directions = np.column_stack([truth.image_xy, np.full(len(truth.image_xy), distance)])
    # The camera looks along -z for both signs of the principal distance.
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
