"""Images of points by photos on trajectories: what a rolling shutter or a line scanner sees, and when."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import shaped
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.network.timed import Timed
from photogram.network.trajectories import Trajectory
from photogram.network.unknowns import Unknown
from photogram.network.whereabouts import reach

__all__ = ["projected"]

Values = Callable[[Unknown], tuple[Floats, Floats]]
"""Position and rotation of a common unknown."""

STEPS = 200
CLOSE = 1e-13
"""Of a whole readout, or of the time between two records that enclose a line."""


def given(unknown: Unknown) -> tuple[Floats, Floats]:
    """Return what is given of a common unknown."""
    return unknown.position, unknown.attitude


def projected(
    own: Timed, trajectory: Trajectory, camera: Camera, points: ArrayLike, values: Values = given
) -> Floats:
    """Return where points appear: the row, or the line, at whose time the photo sees them there.

    A shutter: r = f_row(t(r)), each step some hundredth of the one before. A scanner: the time at which the
    image of the point is on the line of sensors, between the ends of what the trajectory reaches (regula
    falsi, Illinois).

    Parameters
    ----------
    own, trajectory
        The photo, and the trajectory that it is on.
    camera
        Its camera; of scanners in mm.
    points
        (n, 3) X, Y, Z in the axes of the trajectory; geocentric where the object space is geographic.
    values
        What common unknowns are: as they are given, or adjusted.

    Returns
    -------
    (n, 2) image coordinates, of scanners samples and lines; NaN for points that are never seen.

    Raises
    ------
    InputError
        A scanner on a trajectory that has one record, or with a factor of line rates and no time.
    """
    places = shaped("points", points, (len(np.asarray(points)), 3))
    coefficients = [np.array([values(each)[0] for each in part]) for part in trajectory.coefficients]

    def seen(times: Floats) -> Floats:
        """Return the images of the points in a camera that stands still at (n,) times."""
        at, turned, *_ = trajectory.flown(times, *coefficients)
        turned = turned.reshape(-1, 3, 3)
        if own.sensor is not None:
            arm, mount = values(own.sensor)
            at, turned = at + turned @ arm, turned @ mount
        u = np.einsum("nji,nj->ni", turned, places - at)
        return np.where((u[:, 2] < 0)[:, np.newaxis], camera.project(u), np.nan)

    offset = 0.0 if own.offset is None else float(values(own.offset)[0][0])
    rate = 1.0 if own.readout is None else float(values(own.readout)[0][0])
    if own.rate is not None and own.time is None:
        raise InputError(
            f"the scanner {own.photo} has a factor of line rates, which needs a time to count from"
        )
    if own.lines is not None:
        times, samples = _crossed(own, reach(trajectory), seen, len(places))
        # By the clock and the rates of the scanner itself.
        start = float(own.time or 0.0)
        return np.column_stack([samples, own.lines.at(start + (times - offset - start) / rate)])
    times = np.full(len(places), (own.time or 0.0) + offset)
    if own.shutter is None:
        return seen(times)
    rows = np.full(len(places), 0.5)
    for _ in range(STEPS):
        xy = seen(times + rate * rows)
        now = own.shutter.times(xy)
        if not (np.abs(now - rows) > CLOSE).any():
            break
        rows = now
    return seen(times + rate * rows)


def _crossed(
    own: Timed, ends: tuple[float, float], seen: Callable[[Floats], Floats], count: int
) -> tuple[Floats, Floats]:
    """Return the times at which images of points cross the line of sensors, and their samples there."""
    sensor = own.line_sensor
    if sensor is None or not np.isfinite(ends).all():
        raise InputError(f"the scanner {own.photo} needs a trajectory with more than one record")

    def past(times: Floats) -> tuple[Floats, Floats]:
        """Return how far the image of each point is from the line of sensors, and its sample."""
        samples, apart = sensor.abreast(seen(times))
        return apart, samples

    low, high = (np.full(count, end) for end in ends)
    (below, _), (above, _) = past(low), past(high)
    crossed = below * above <= 0
    for _ in range(STEPS):
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = high - above * (high - low) / (above - below)
        middle = np.where(np.isfinite(middle), middle, 0.5 * (low + high))
        found, samples = past(middle)
        left = found * above > 0
        # The end that stays counts half, so that it does not stay for ever.
        below = np.where(left, 0.5 * below, above)
        low = np.where(left, low, high)
        moved = np.abs(middle - high)
        high, above = middle, found
        if not (moved[crossed] > CLOSE * (ends[1] - ends[0])).any():
            break
    return np.where(crossed, high, np.nan), np.where(crossed, samples, np.nan)
