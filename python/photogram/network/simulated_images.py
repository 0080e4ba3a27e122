"""Simulated layouts of strips over gentle relief with a grid of ground points, and the images of cameras.

The block is laid out in a plane: x along the strips, y across, z up, origin at the centre on the mean
terrain. The grid of ground points is locked to the photographs: a column below each projection centre, and a
row in the centre of each side overlap. Neighbouring photographs and strips are therefore connected, and the
visible points of a photograph are predictable.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.memory import available_memory
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.block_checks import checked_cameras
from photogram.network.cameras import Camera, images_of
from photogram.network.moving_photos import Direction, Shutter, Timed
from photogram.network.observations import Attitude
from photogram.network.projecting import camera_of, projected_images
from photogram.network.simulation_options import GUSTS, RollingShutter, SimulationOptions
from photogram.network.trajectories import Readout
from photogram.words import phrase

_FAR_MORE = 10.0  # Maximum ratio of generated to requested points
_AT_ONCE = 2**22  # Maximum number of pairs of photo and point that are processed together
_CANDIDATE_BYTES, _IMAGE_BYTES = 300, 240
"""Peak memory in bytes for such a pair, and for an image observation."""
_JITTER = 0.15  # maximum shift in grid cells: points in the centre of an overlap remain in the overlap


@dataclass(frozen=True)
class Layout:
    """Flight plan and point grid; lengths in metres."""

    strips: int
    photos_per_strip: int
    base: float  # between photographs of a strip
    separation: float  # of neighbouring strips
    columns_per_base: int
    rows_per_strip: int
    reach: float  # maximum distance in x or y of a visible point from the point below the photograph

    @property
    def length(self) -> float:
        """Length of a strip, from the first photograph to the last."""
        return (self.photos_per_strip - 1) * self.base

    @property
    def width(self) -> float:
        """Distance from the first strip to the last."""
        return (self.strips - 1) * self.separation

    @property
    def cell(self) -> tuple[float, float]:
        """Distance between columns and between rows of the grid."""
        return self.base / self.columns_per_base, self.separation / self.rows_per_strip


def laid_out(options: SimulationOptions, reach: float) -> Layout:
    """Lay out strips; lengths in metres.

    InputError if there are many more image points than requested, or too many for the memory.
    """
    strips, photos_per_strip = options.strips, options.photos_per_strip
    footprint, points_per_photo = options.footprint, options.points_per_photo
    base, separation = (1 - options.forward_overlap) * footprint, (1 - options.side_overlap) * footprint
    # Correct for points that only one photo of one strip sees, because they are removed.
    photos = strips * photos_per_strip
    lost = _covered_once(photos_per_strip, base, footprint) * _covered_once(strips, separation, footprint)
    density = points_per_photo * photos / (photos * footprint**2 - lost)
    columns = max(1, round(base * math.sqrt(density)))
    rows = max(1, round(density * base * separation / columns))
    plan = Layout(strips, photos_per_strip, base, separation, columns, rows, reach)
    dx, dy = plan.cell
    fewest = footprint**2 / (dx * dy)
    if fewest > _FAR_MORE * points_per_photo:
        raise InputError(phrase("simulation.many-points", points=fewest, wanted=points_per_photo))
    needed, available = _CANDIDATE_BYTES * _AT_ONCE + _IMAGE_BYTES * photos * fewest, available_memory()
    if available is not None and needed > available:
        sizes = {"needed": needed / 2**30, "available": available / 2**30}
        raise InputError(phrase("simulation.memory", **sizes))
    return plan


def _covered_once(count: int, step: float, length: float) -> float:
    """Return the length covered by one of `count` intervals only; their starts differ by `step`."""
    if count == 1:
        return length
    return 2 * step + (count - 2) * max(0.0, 2 * step - length)


def window(plan: Layout) -> tuple[Indices, Indices]:
    """Return grid columns and rows in view, relative to the column and half-strip below."""
    dx, dy = plan.cell
    columns = math.ceil(plan.reach / dx + _JITTER)
    middle, rows = -plan.rows_per_strip / 2, plan.reach / dy + _JITTER
    return np.arange(-columns, columns + 1), np.arange(
        math.floor(middle - rows), math.ceil(middle + rows) + 1
    )


def grid(plan: Layout) -> tuple[Indices, Indices]:
    """Return all grid columns and rows in view of any photograph."""
    columns, rows = window(plan)
    last_column = (plan.photos_per_strip - 1) * plan.columns_per_base + columns[-1]
    last_row = (plan.strips - 1) * plan.rows_per_strip + rows[-1]
    return np.arange(columns[0], last_column + 1), np.arange(rows[0], last_row + 1)


def candidates(plan: Layout) -> Iterator[tuple[Indices, Indices]]:
    """Yield pairs of photo and visible grid point in batches, sorted by photo, then point."""
    columns, rows = window(plan)
    _, all_rows = grid(plan)
    step = max(1, _AT_ONCE // (len(columns) * len(rows)))
    count = plan.strips * plan.photos_per_strip
    for first in range(0, count, step):
        some = np.arange(first, min(first + step, count))
        strip, number = np.divmod(some, plan.photos_per_strip)
        column = (number * plan.columns_per_base)[:, None, None] + (columns - columns[0])[:, None]
        row = (strip * plan.rows_per_strip)[:, None, None] + (rows - rows[0])
        points = column * len(all_rows) + row
        yield np.broadcast_to(some[:, None, None], points.shape).ravel(), points.ravel()


def ground_points(plan: Layout, options: SimulationOptions, random: np.random.Generator) -> Floats:
    """Generate ground points in the plan, (n, 3), column by column: a jittered grid on waves."""
    dx, dy = plan.cell
    columns, rows = grid(plan)
    x, y = np.meshgrid(
        columns * dx - plan.length / 2, (rows + plan.rows_per_strip / 2) * dy - plan.width / 2, indexing="ij"
    )
    jitter = random.uniform(-_JITTER, _JITTER, (2, *x.shape))
    x, y = x + dx * jitter[0], y + dy * jitter[1]
    waves = 8
    heading, phase = random.uniform(0, 2 * math.pi, (2, waves))
    wave_number = 2 * math.pi / (options.footprint * random.uniform(1.0, 5.0, waves))
    z = np.zeros_like(x)
    for h, k, p in zip(heading, wave_number, phase, strict=True):
        z += options.relief / waves * np.sin(k * (math.cos(h) * x + math.sin(h) * y) + p)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def flight(plan: Layout, options: SimulationOptions, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Return projection centres in the plan and rotations from the plan to the photos."""
    strip, number = np.divmod(np.arange(plan.strips * plan.photos_per_strip), plan.photos_per_strip)
    x, y = number * plan.base - plan.length / 2, strip * plan.separation - plan.width / 2
    deviation = random.uniform(-1.0, 1.0, (len(strip), 3)) * [options.tilt, options.tilt, options.crab]
    deviation[:, 2] += math.pi * (strip % 2)
    positions = np.stack([x, y, np.full(len(x), options.flying_height)], axis=1)
    return positions, geometry.rotation_matrix(deviation)


def into_object_space(
    plan_positions: Floats, rotations: Floats | None, options: SimulationOptions
) -> tuple[Floats, Floats]:
    """Transform positions and, if given, rotations from the plan to the object space."""
    origin, spheroid = options.origin, options.spheroid
    positions = plan_positions + np.asarray(origin)
    if spheroid is not None:
        tangent_point = np.array([[origin[0], origin[1], 0.0]])
        frame = geometry.local_frames(tangent_point)[0]
        plane = plan_positions * [1.0, 1.0, 0.0]
        xyz = geometry.geographic_to_geocentric(tangent_point, spheroid) + plane @ frame
        positions = geometry.geocentric_to_geographic(xyz, spheroid)
        positions[:, 2] = plan_positions[:, 2] + origin[2]
    if rotations is None:
        return positions, np.empty((0, 3))
    if spheroid is not None:
        # East at the station, seen from the plan, is rotated about the vertical by meridian convergence.
        in_plan = geometry.local_frames(positions)[:, 0] @ frame.T
        convergence = np.zeros_like(positions)
        convergence[:, 2] = -np.arctan2(in_plan[:, 1], in_plan[:, 0])
        rotations = rotations @ geometry.rotation_matrix(convergence)
    matrices = rotations.transpose(0, 2, 1) if options.photo_to_ground else rotations
    return positions, geometry.rotation_angles(matrices)


def control_pattern(plan: Layout, terrain: Floats, pattern: str, spacing: int) -> Bools:
    """Return (n, 3) which components of points are control."""
    held = np.zeros(terrain.shape, dtype=bool)
    if pattern == "none":
        return held
    right, top = plan.length / 2, (plan.width + plan.separation) / 2
    along, across = 2, 2
    if pattern == "perimeter":
        along = max(2, round(2 * right / (spacing * plan.base)) + 1)
        across = max(2, round(2 * top / (spacing * plan.base)) + 1)
    xs, ys = np.linspace(-right, right, along), np.linspace(-top, top, across)
    full = [(x, y) for x in xs for y in (-top, top)] + [(x, y) for x in (-right, right) for y in ys[1:-1]]
    height = []
    if pattern == "perimeter":
        overlaps = np.linspace(-top, top, plan.strips + 1)[1:-1]
        height = [(x, y) for x in xs[1:-1] for y in overlaps]
    # Along the longer side, few points are close to a control position.
    axis = int(top > right)
    order = np.argsort(terrain[:, axis])
    along_axis = terrain[order, axis]
    for places, components in ((height, slice(2, 3)), (full, slice(0, 3))):
        for place in places:
            low, high = np.searchsorted(along_axis, [place[axis] - plan.reach, place[axis] + plan.reach])
            near = order[low:high]
            held[near[np.argmin(((terrain[near, :2] - place) ** 2).sum(axis=1))], components] = True
    return held


def photo_ids(plan: Layout) -> list[str]:
    strip_digits, number_digits = (max(2, len(str(count))) for count in (plan.strips, plan.photos_per_strip))
    return [
        f"{strip:0{strip_digits}d}{number:0{number_digits}d}"
        for strip in range(1, plan.strips + 1)
        for number in range(1, plan.photos_per_strip + 1)
    ]


def point_ids(held: Bools, checks: Indices) -> list[str]:
    """Return point names: C for control points, K for check points, P for pass points."""
    kind = np.where(held.any(axis=1), "C", "P")
    kind[checks] = "K"
    return [f"{letter}{number:06d}" for number, letter in enumerate(kind, start=1)]


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
    frame in principal distances. Each photo has its own uniform motion, as in the adjustment; it is true in
    the first block.
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
