"""Projection of points into photos on trajectories (rolling shutters and line scanners)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import shaped
from photogram.arguments.objects import require
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.geometry import geographic_to_geocentric
from photogram.network.motion import timed_images
from photogram.network.moving_photos import Timed
from photogram.network.trajectories import Trajectory
from photogram.network.unknowns import Unknown
from photogram.words import phrase

Values = Callable[[Unknown], tuple[Floats, Floats]]  # Position and rotation of a shared unknown

STEPS = 200
CLOSE, CLOSE_LINES = 1e-13, 1e-9  # Relative to the whole readout; to a line, whose times have enough digits
ROUNDED = 1e-9  # Relative to the whole readout: largest effect of rounding


def given(unknown: Unknown) -> tuple[Floats, Floats]:
    return unknown.position, unknown.attitude


def projected(
    own: Timed, trajectory: Trajectory, camera: Camera, points: ArrayLike, values: Values = given
) -> Floats:
    """Project points into a moving photo: each image has the pose at its own time.

    Rolling shutter: fixed-point iteration r = f_row(t(r)), which gains about two digits per step. Scanner:
    time at which the image of the point is on the line of sensors, within the reach of the trajectory (regula
    falsi, Illinois).

    Points are (n, 3) in the axes of the trajectory, geocentric if the object space is geographic. `values`
    returns given or adjusted values of shared unknowns. Images are (n, 2), for scanners samples and lines;
    NaN if a point is never seen. InputError if the trajectory of a scanner has one record, or a factor of
    line rates requires a missing reference time.
    """
    places = shaped("points", points, (None, 3))

    def seen(times: Floats, rows: Indices | slice = slice(None)) -> Floats:
        return standing(own, trajectory, camera, places[rows], times, values=values)

    offset = 0.0 if own.offset is None else float(values(own.offset)[0][0])
    rate = 1.0 if own.readout is None else float(values(own.readout)[0][0])
    require(
        own.rate is None or own.time is not None, f"photo {own.photo}", "requires", name="rate", other="time"
    )
    if own.lines is not None:
        times, samples = _crossed(own, trajectory.reach, seen, len(places))
        # According to the clock and the rates of the scanner.
        start = float(own.time or 0.0)
        return np.column_stack([samples, own.lines.at(start + (times - offset - start) / rate)])
    times = np.full(len(places), (own.time or 0.0) + offset)
    if own.shutter is None:
        return seen(times)
    rows, before = np.full(len(places), 0.5), np.inf
    for _ in range(STEPS):
        now = own.shutter.times(seen(times + rate * rows))
        moved = float(np.fmax.reduce(np.abs(now - rows), initial=0.0))
        rows = now
        # Rows of large coordinates have fewer digits and continue to change by rounding.
        if moved <= CLOSE or before <= moved < ROUNDED:
            break
        before = moved
    return seen(times + rate * rows)


def standing(
    own: Timed,
    trajectory: Trajectory,
    camera: Camera,
    points: Floats,
    times: Floats,
    *,
    values: Values = given,
) -> Floats:
    """Project (n, 3) points with the camera pose at (n,) times; NaN for points behind it.

    Scanner images are in the focal plane; other arguments as in :func:`projected`.
    """
    coefficients = [np.array([values(each)[0] for each in part]) for part in trajectory.coefficients]
    at, turned, *_ = trajectory.flown(times, *coefficients)
    turned = turned.reshape(-1, 3, 3)
    if own.sensor is not None:
        arm, mount = values(own.sensor)
        at, turned = at + turned @ arm, turned @ mount
    u = np.einsum("nji,nj->ni", turned, points - at)
    return np.where((u[:, 2] < 0)[:, np.newaxis], camera.project(u), np.nan)


def projected_images(block: Block) -> Floats:
    """Return (m, 2) images of a block with all photos on trajectories, from given values.

    InputError if the block has refraction, and as in :func:`projected`.
    """
    if block.refraction is not None:
        raise InputError(phrase("block.timed.refraction"))
    points = block.point_positions
    if block.spheroid is not None:
        points = geographic_to_geocentric(points, block.spheroid)
    found = np.full(block.image_xy.shape, np.nan)
    for own, trajectory, row, images in timed_images(block):
        if len(images):
            places = points[block.image_points[images]]
            found[images] = projected(own, trajectory, camera_of(block, row), places)
    return found


def camera_of(block: Block, photo: int) -> Camera:
    """Return the given camera of a photo, also for a block with principal distances."""
    if block.cameras and block.photo_cameras is not None:
        return block.cameras[int(block.photo_cameras[photo])]
    return Camera("perspective", {"c": float(block.known_distances("the projection")[photo])})


def _crossed(
    own: Timed, ends: tuple[float, float], seen: Callable[[Floats, Indices], Floats], count: int
) -> tuple[Floats, Floats]:
    """Return the times at which point images cross the line of sensors, and their samples."""
    sensor, lines = own.line_sensor, own.lines
    if sensor is None or lines is None or not np.isfinite(ends).all():
        raise InputError(phrase("block.timed.one-record", photo=own.photo))

    def past(times: Floats, rows: Indices) -> tuple[Floats, Floats]:
        """Return the distance of each point image from the line of sensors, and its sample."""
        samples, apart = sensor.abreast(seen(times, rows))
        return apart, samples

    rows: Indices = np.arange(count)
    low: Floats
    high: Floats
    low, high = (np.full(count, end) for end in ends)
    (below, _), (above, _) = past(low, rows), past(high, rows)
    times, samples = np.full((2, count), np.nan)
    seconds = np.abs(np.asarray(lines.table)[:, 2]).min()
    close = max(CLOSE_LINES * seconds, 4 * np.spacing(np.abs(ends).max()))
    going = below * above <= 0
    for _ in range(STEPS):
        rows = rows[going]
        low, high, below, above = (each[going] for each in (low, high, below, above))
        if not len(rows):
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = high - above * (high - low) / (above - below)
        middle = np.where(np.isfinite(middle), middle, 0.5 * (low + high))
        found, samples[rows] = past(middle, rows)
        left = found * above > 0
        # The retained end gets half weight, so that it is replaced eventually.
        below = np.where(left, 0.5 * below, above)
        low = np.where(left, low, high)
        going = np.abs(middle - high) > close
        times[rows] = high = middle
        above = found
    return times, samples
