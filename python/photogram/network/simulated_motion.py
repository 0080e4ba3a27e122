"""Motion of simulated cameras during exposure: rolling shutters and line scanners.

The true motion of a rolling shutter is uniform. A true scanner trajectory is a table with corrections drawn
from their prior. Both match the model of the adjustment, so that errors agree with their covariance.
"""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.moving_photos import Direction, Shutter, Timed
from photogram.network.observations import Attitude
from photogram.network.projecting import camera_of, projected_images
from photogram.network.simulated_layout import Layout
from photogram.network.simulation_options import GUSTS, RollingShutter
from photogram.network.trajectories import Readout

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
    """Return (P,) camera rows of the photos; 0 for principal distances."""
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
