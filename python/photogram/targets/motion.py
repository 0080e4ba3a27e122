"""Motion of a board about each view, for a rig of cameras with clock offsets.

About the time t0 of a view (the time of its image by the reference camera), photos of this camera move as

    C(t) = C0 + sum c_k (t - t0)^k,        A(t) = A0 Exp(sum r_k (t - t0)^k),        k = 1 .. 4

through the views before and after. An image of another camera with time t shows the board at t + tau.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.network.moving_photos import Timed
from photogram.network.trajectories import Clock, Polynomial, Table, Trajectory
from photogram.network.unknowns import Sensor
from photogram.targets.corners import Corners
from photogram.targets.vision import FLIP, composed, photo_poses
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets import Calibration

CLOCK = "of "  # prefix of the camera in the name of its clock offset
MAX_GAP_SECONDS = 0.2  # between views that determine the motion of the board
EACH_SIDE = 2
POWERS = 2 * EACH_SIDE  # of time


def dated(corners: Corners, tied: Bools) -> Floats:
    """Return (V,) view times from images of reference cameras; NaN without one."""
    if corners.times is None:
        raise InputError(phrase("targets.no-shown-times"))
    found = np.full(corners.view_count, np.nan)
    own = ~tied[corners.cameras]
    found[corners.views[own]] = corners.times[own]
    return found


def moving(poses: Floats, times: Floats, references: Indices) -> Floats:
    """Return (V, 4, 6) c_k and r_k of views from up to two neighbours on each side.

    Poses are (V, 4, 4) board -> reference, times and references (V,) of views. NaN for views without
    neighbours within 0.2 s before and after, 0 for undetermined powers.
    """
    found = np.full((len(poses), POWERS, 6), np.nan)
    places, attitudes = photo_poses(poses)
    turned = attitudes.matrices
    for row, others in _neighbours(times, references):
        shifts = places[others] - places[row]
        turns = _photocore.rotation_vectors(turned[row].T @ turned[others])
        own = _through(times[others] - times[row]) @ np.column_stack([shifts, turns])
        found[row] = np.pad(own, ((0, POWERS - len(own)), (0, 0)))
    return found


def errors_of_speeds(times: Floats, references: Indices) -> Floats:
    """Return (V,) variances of c_1 and r_1 relative to the poses; NaN if undefined."""
    found = np.full(len(times), np.nan)
    for row, others in _neighbours(times, references):
        weights = _through(times[others] - times[row])[0]
        found[row] = weights @ weights + weights.sum() ** 2
    return found


def _neighbours(times: Floats, references: Indices) -> Iterator[tuple[int, Indices]]:
    """Yield views with equal numbers of neighbours before and after, without gaps."""
    for reference in np.unique(references):
        rows = np.flatnonzero((references == reference) & np.isfinite(times))
        rows = rows[np.argsort(times[rows], kind="stable")]
        gaps = np.diff(times[rows])
        if (gaps <= 0).any():
            time = float(times[rows[int(np.argmin(gaps))]])
            raise InputError(phrase("targets.equal-times", time=time))
        for k, row in enumerate(rows.tolist()):
            # gaps[k] follows the k-th view.
            sides = [
                n
                for n in range(1, min(EACH_SIDE, k, len(gaps) - k) + 1)
                if (gaps[k - n : k + n] < MAX_GAP_SECONDS).all()
            ]
            if sides:
                yield row, rows[[*range(k - sides[-1], k), *range(k + 1, k + sides[-1] + 1)]]


def _through(steps: Floats) -> Floats:
    """Return (n, n) the map from values at (n,) time steps to coefficients of powers."""
    return np.asarray(np.linalg.inv(steps[:, np.newaxis] ** np.arange(1, len(steps) + 1)))


def moved(poses: Floats, motion: Floats, steps: Floats) -> Floats:
    """Return (n, 4, 4) poses, board -> reference, after (n,) time steps of motions."""
    places, attitudes = photo_poses(poses)
    own = np.einsum("nk,nkc->nc", steps[:, np.newaxis] ** np.arange(1, POWERS + 1), motion)
    turned = attitudes.matrices @ _photocore.vector_rotations(own[:, 3:])
    rotation = FLIP @ np.swapaxes(turned, 1, 2)
    return composed(rotation, -np.einsum("nij,nj->ni", rotation, places + own[:, :3]))


def pictures_in_motion(calibration: Calibration, sensors: Sequence[Sensor]) -> list[Timed]:
    """Return the images as trajectories with unknown view poses and known motion."""
    corners, tied = calibration.corners, calibration.tied
    assert corners.times is not None
    places, attitudes = photo_poses(np.asarray(calibration.poses))
    offsets, sd = np.asarray(calibration.offsets).tolist(), np.asarray(calibration.sd_offsets).tolist()
    times, motion, flights = dated(corners, tied), np.asarray(calibration.motion), []
    for view, name in enumerate(corners.view_names()):
        one = slice(view, view + 1)
        table = Table(times[one], places[one], times[one], attitudes.matrices[one])
        position, rotation = (
            _known(float(times[view]), motion[view, :, part]) for part in (slice(3), slice(3, 6))
        )
        flights.append(Trajectory(name, table, position, rotation))
    ties = [
        (sensors[k], Clock(CLOCK + name, offsets[k], sd[k])) if own else (None, None)
        for k, (name, own) in enumerate(zip(corners.camera_names, tied.tolist(), strict=True))
    ]
    rows = zip(corners.views.tolist(), corners.times.tolist(), corners.cameras.tolist(), strict=True)
    return [
        Timed(name, flights[view], time, sensor=ties[camera][0], offset=ties[camera][1])
        for name, (view, time, camera) in zip(corners.pictures, rows, strict=True)
    ]


def _known(time: float, motion: Floats) -> Polynomial:
    told = np.nan_to_num(motion)
    told = told[: int(np.flatnonzero(told.any(axis=1)).max(initial=-1)) + 1]
    value = np.vstack([np.zeros(3), told])
    sd = np.zeros_like(value)
    sd[0] = np.inf
    return Polynomial(len(told), time, 1.0, value, sd)


def motion_of(flight: Trajectory) -> Floats | None:
    """Return (4, 6) the motion of a view trajectory; None for other trajectories."""
    found = np.zeros((POWERS, 6))
    for part, basis in ((slice(3), flight.position), (slice(3, 6), flight.rotation)):
        if not isinstance(basis, Polynomial) or basis.degree > POWERS or basis.scale != 1.0:
            return None
        value = np.broadcast_to(basis.value, (basis.count, 3))
        found[: basis.degree, part] = value[1:]
    alone = len(flight.table.times) == 1 and flight.body is None
    return found if alone and flight.angles == "vector" else None
