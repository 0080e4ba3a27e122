"""Where a trajectory is before anything is adjusted."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.network.trajectories import Trajectory

__all__ = ["about", "given_poses"]


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
    places, matrices = given_poses(trajectory, np.clip([time], *trajectory.reach))
    return places[0], matrices[0]


def given_poses(trajectory: Trajectory, times: Floats) -> tuple[Floats, Floats]:
    """Return (n, 3) places and (n, 3, 3) axes at (n,) times that the trajectory reaches, as :func:`about`."""
    position, rotation = (np.array([each.position for each in own]) for own in trajectory.coefficients)
    places, matrices, *_ = trajectory.flown(times, position, rotation)
    return places, matrices.reshape(-1, 3, 3)
