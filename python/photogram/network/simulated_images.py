"""Images of the simulated ground by cameras at rest, by other cameras, and by rolling shutters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.block_checks import checked_cameras
from photogram.network.cameras import Camera, images_of
from photogram.network.moving_photos import Direction, Shutter, Timed
from photogram.network.observations import Attitude
from photogram.network.projecting import camera_of, projected_images
from photogram.network.simulated_layout import Layout, candidates, photo_ids
from photogram.network.simulation_options import GUSTS, RollingShutter, SimulationOptions
from photogram.network.trajectories import Readout
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


_STARTS = 0.5  # Initial value of an unknown readout time, relative to the true one


def photo_angles(axes: Floats, photo_to_ground: bool) -> Floats:
    """Return (P, 3) omega, phi, kappa of photos with (P, 3, 3) axes as columns."""
    return geometry.rotation_angles(axes if photo_to_ground else axes.transpose(0, 2, 1))


def rolled(
    truth: Block,
    block: Block,
    shutter: RollingShutter,
    layout: Layout,
    frame: float,
    random: np.random.Generator,
) -> tuple[Block, Block]:
    """Simulate the motion of photos with a rolling shutter; return truth and block.

    Both are in rectangular space, and strips are flown in opposite directions. `frame` is the side of the
    frame in principal distances. Each photo has its own motion, which is true in the first block.
    """
    count = len(truth.photo_ids)
    strip, along = np.divmod(np.arange(count), layout.photos_per_strip)
    sense = 1.0 - 2.0 * (strip % 2)
    velocities = GUSTS * shutter.speed * random.standard_normal((count, 3))
    velocities[:, 0] += sense * shutter.speed
    rates = shutter.rate * random.standard_normal((count, 3))
    nominal = np.column_stack([sense * shutter.speed, np.zeros((count, 2))])
    known = (
        _observed(velocities, nominal, shutter.speed_sd, random),
        _observed(rates, np.zeros((count, 3)), shutter.rate_sd, random),
    )
    along = np.where(sense > 0, along, layout.photos_per_strip - 1 - along)
    flown = strip * layout.photos_per_strip + along
    times = np.round(flown * layout.base / shutter.speed, 3) if shutter.speed else flown.astype(float)
    off = shutter.readout_sd * random.standard_normal() if math.isfinite(shutter.readout_sd) else None
    start = _STARTS * shutter.readout if off is None else shutter.readout + off
    block = _with_attitudes(block, truth, random.standard_normal((count, 3)))
    truth = _with_attitudes(truth, truth, np.zeros((count, 3)))
    edges = _edges(truth, shutter.direction, frame)
    truth = _timed(truth, shutter, shutter.readout, edges, times, (velocities, rates))
    block = _timed(block, shutter, start, edges, times, known)
    images = projected_images(truth)
    return truth.replace(image_xy=images), block.replace(image_xy=images + block.image_xy - truth.image_xy)


def _observed(true: Floats, nominal: Floats, sd: float, random: np.random.Generator) -> Floats:
    """Return observed values with noise, or nominal values if `sd` is infinite."""
    draw = random.standard_normal(true.shape)
    return true + sd * draw if math.isfinite(sd) else nominal


def _with_attitudes(block: Block, truth: Block, draw: Floats) -> Block:
    """Convert weighted attitudes of moving photos to attitude observations.

    `truth` contains the true attitudes, `draw` the normalised errors.
    """
    sd = truth.photo_attitude_sd
    if not ((sd > 0) & np.isfinite(sd)).any():
        return block
    axes, turns = geometry.photo_axes(truth.photo_attitudes, truth.photo_to_ground), sd * draw
    observed = Attitude.from_arrays(
        photo=truth.photo_ids, attitude=axes @ _photocore.vector_rotations(turns), sd=sd
    )
    return block.replace(
        photo_attitude_sd=np.inf,
        photo_attitudes_observed=None,
        observations=[block.observations, observed],
    )


def _timed(
    block: Block,
    shutter: RollingShutter,
    readout: float,
    edges: list[tuple[float, float]],
    times: Floats,
    motions: tuple[Floats, Floats],
) -> Block:
    """Return a block with own motions of the photos, and a shutter for each camera."""
    cameras = _photo_cameras(block)
    names = block.camera_names if block.cameras else ["camera 1"]
    shutters = [
        Shutter(Readout(name, readout, shutter.readout_sd), own, shutter.direction)
        for name, own in zip(names, edges, strict=True)
    ]
    timed = [
        Timed(
            name,
            time=time,
            shutter=shutters[camera],
            velocity=velocity,
            rotation_rate=rate,
            sd_velocity=shutter.speed_sd,
            sd_rate=shutter.rate_sd,
        )
        for name, time, camera, velocity, rate in zip(
            block.photo_ids, times.tolist(), cameras.tolist(), *motions, strict=True
        )
    ]
    return block.replace(timed=timed)


def _photo_cameras(block: Block) -> Indices:
    given = block.photo_cameras
    return np.zeros(len(block.photo_ids), dtype=np.int64) if given is None else given


def _edges(block: Block, direction: Direction, frame: float) -> list[tuple[float, float]]:
    """Return the image coordinates of the readout edges, start and end, for each camera."""
    axis = 1 if direction in ("down", "up") else 0
    found = []
    for photo in np.unique(_photo_cameras(block), return_index=True)[1].tolist():
        camera = camera_of(block, photo)
        middle = float(camera.project(np.array([[0.0, 0.0, -1.0]]))[0, axis])
        half = frame / 2 * camera.scale
        ascending = (direction == "down") == (camera.image_y == "down") if axis else direction == "right"
        found.append((middle - half, middle + half) if ascending else (middle + half, middle - half))
    return found
