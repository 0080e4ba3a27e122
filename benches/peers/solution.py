"""What every side of the comparison returns, and the camera frame that the peers share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from photogram import Block, Result
from photogram.network.geometry import rotation_matrix

Floats = NDArray[np.float64]

HALF_TURN = np.diag([1.0, -1.0, -1.0])
"""From the photo's frame (z up, away from the ground) to the peers' camera frame (z forward)."""


@dataclass(frozen=True)
class Solution:
    """The solution of a block, under the names of the fields of photogram's `Result`."""

    converged: bool
    iterations: int
    initial_weighted_sum_of_squares: float
    weighted_sum_of_squares: float
    photo_positions: Floats
    photo_attitudes: Floats
    point_positions: Floats

    @classmethod
    def of(cls, result: Result) -> Solution:
        """Return photogram's own."""
        return cls(
            converged=result.converged,
            iterations=len(result.iterations),
            initial_weighted_sum_of_squares=result.initial_weighted_sum_of_squares,
            weighted_sum_of_squares=result.sums_of_squares.total,
            photo_positions=result.photo_positions,
            photo_attitudes=result.photo_attitudes,
            point_positions=result.point_positions,
        )


def to_object_space(block: Block) -> Floats:
    """Return the rotations from camera to object space of the initial photographs, (P, 3, 3)."""
    matrices = rotation_matrix(block.photo_attitudes)
    if block.photo_to_ground:
        matrices = matrices.transpose(0, 2, 1)
    rotations: Floats = (HALF_TURN @ matrices).transpose(0, 2, 1)
    return rotations


def check(block: Block) -> None:
    """Raise ValueError for what no peer is given: geographic space, weighted photographs, fixed control."""
    free = np.isinf(block.photo_position_sd).all() and np.isinf(block.photo_attitude_sd).all()
    if block.geographic or not free or (block.point_sd == 0).any():
        raise ValueError("a block in rectangular space with free photographs and weighted control is wanted")


def in_standard_deviations(block: Block) -> Floats:
    """Return the focal lengths fx = -c, fy = c and the coordinates of every image point, (n, 4).

    In standard deviations of the coordinates, for peers whose weights are all 1.
    """
    focal = block.principal_distances[block.image_photos, np.newaxis] * [-1.0, 1.0]
    return np.hstack([focal / block.image_sd, block.image_xy / block.image_sd])
