"""Rotation matrices of files, and the axes of photos that count y downwards."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.places import Failing

Y_DOWN: Floats = np.diag([1.0, -1.0, -1.0])
"""Carries vectors between axes x right, y up, z back and axes x right, y down, z forward."""


def is_rotation(matrix: Floats, tolerance: float = 1e-6) -> bool:
    """Whether a (3, 3) matrix is orthonormal, up to the digits that a file has, and not mirrored."""
    with np.errstate(over="ignore", invalid="ignore"):
        apart = np.abs(matrix @ matrix.T - np.eye(3)).max()
    return bool(apart < tolerance and np.linalg.det(matrix) > 0)


def checked_rotation(place: Failing, matrix: Floats) -> Floats:
    """Return a rotation matrix of a file, orthonormal to the last bits."""
    if not is_rotation(matrix):
        raise place.error("is no rotation matrix: not orthonormal, or mirrored")
    found: Floats = matrix @ (3 * np.eye(3) - matrix.T @ matrix) / 2
    return found
