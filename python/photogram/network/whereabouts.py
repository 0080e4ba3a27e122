"""Where a trajectory is before anything is adjusted, and which times it has."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.network.trajectories import Spline, Trajectory

__all__ = ["about", "given_poses", "reach"]


def reach(trajectory: Trajectory) -> tuple[float, float]:
    """Return the first and the last time that a trajectory may be asked for, in seconds.

    They lie half a record beyond its table, and within the knots of its splines, as the core has it.
    """
    table = trajectory.table
    spans = [_reaching(each) for each in (table.times, table.attitude_times)]
    if trajectory.body is not None:
        spans.append(_reaching(np.asarray(trajectory.body[0])))
    for basis in (trajectory.position, trajectory.rotation):
        if isinstance(basis, Spline):
            knots = np.asarray(basis.knots, dtype=float)
            spans.append((float(knots[basis.degree]), float(knots[-basis.degree - 1])))
    return max(first for first, _ in spans), min(last for _, last in spans)


def _reaching(times: Floats) -> tuple[float, float]:
    """Return the times of records, and half an interval beyond; all times where there is one alone."""
    if len(times) == 1:
        return -np.inf, np.inf
    first, last = times[1] - times[0], times[-1] - times[-2]
    return float(times[0] - first / 2), float(times[-1] + last / 2)


def about(trajectory: Trajectory, time: float) -> tuple[Floats, Floats]:
    """Return the pose of a trajectory by what is given of its corrections.

    Parameters
    ----------
    trajectory
        The trajectory.
    time
        Seconds; beyond what it reaches the pose is that of its end.

    Returns
    -------
    (3,) X, Y, Z, geocentric where the object space is geographic, and (3, 3) the axes of the photo in these.
    """
    places, matrices = given_poses(trajectory, np.clip([time], *reach(trajectory)))
    return places[0], matrices[0]


def given_poses(trajectory: Trajectory, times: Floats) -> tuple[Floats, Floats]:
    """Return (n, 3) places and (n, 3, 3) axes at (n,) times that the trajectory reaches, as :func:`about`."""
    position, rotation = (np.array([each.position for each in own]) for own in trajectory.coefficients)
    places, matrices, *_ = trajectory.flown(times, position, rotation)
    return places, matrices.reshape(-1, 3, 3)
