"""Poses in axes of computer vision (x right, y down, z forward) as photos of a block have them, and back.

A pose is a (4, 4) matrix [R t; 0 1]: of a view, board -> camera 0; of a sensor, camera 0 -> camera k. Photos
have A = R'F and C = -R't, with F = diag(1, -1, -1). Steps of a pose are R <- Exp(w) R, t <- t + dt.
"""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.network.attitudes import Attitudes

__all__ = [
    "FLIP",
    "composed",
    "cross_matrices",
    "inverted",
    "moved_by",
    "of_vectors",
    "photo_poses",
    "sensor_pose",
    "sensor_steps",
    "view_steps",
    "vision_poses",
]

FLIP: Floats = np.diag([1.0, -1.0, -1.0])


def composed(rotations: Floats, translations: Floats) -> Floats:
    """Return (..., 4, 4) poses of rotations (..., 3, 3) and translations (..., 3)."""
    found = np.zeros((*np.shape(translations)[:-1], 4, 4))
    found[..., :3, :3], found[..., :3, 3], found[..., 3, 3] = rotations, translations, 1.0
    return found


def photo_poses(poses: Floats) -> tuple[Floats, Attitudes]:
    """Return (n, 3) positions C and the attitudes A of photos."""
    attitudes = Attitudes.of("matrix_to_vision", poses[:, :3, :3])
    return attitudes.positions(poses[:, :3, 3]), attitudes


def vision_poses(positions: Floats, attitudes: Attitudes) -> Floats:
    """Return (n, 4, 4) the poses of photos with the positions C and the attitudes A."""
    return composed(attitudes.values("matrix_to_vision"), attitudes.translations(positions))


def of_vectors(vectors: Floats) -> Floats:
    """Return (n, 4, 4) poses of (n, 6) rotation vectors and translations, as OpenCV and mrcal have them."""
    attitudes = Attitudes.of("rotation_vector_to_vision", vectors[:, :3])
    return composed(attitudes.values("matrix_to_vision"), vectors[:, 3:])


def inverted(pose: Floats) -> Floats:
    """Return (4, 4) the way back: [R' -R't; 0 1]."""
    turned = pose[:3, :3].T
    return composed(turned, -turned @ pose[:3, 3])


def sensor_pose(position: Floats, attitude: Floats) -> Floats:
    """Return (4, 4) the pose frame -> sensor of one with the position c and the attitude A on its frame.

    A = F R'F and c = -F R't.
    """
    rotation = FLIP @ attitude.T @ FLIP
    return composed(rotation, -rotation @ FLIP @ position)


def moved_by(pose: Floats, step: Floats) -> Floats:
    """Return (4, 4) a pose after a small motion (dt, w) of all that it leads to: p <- Exp(w) p + dt."""
    turn = _photocore.vector_rotations(step[np.newaxis, 3:])[0]
    return composed(turn @ pose[:3, :3], turn @ pose[:3, 3] + step[:3])


def cross_matrices(vectors: Floats) -> Floats:
    """Return (..., 3, 3) matrices [v]x of (..., 3) vectors: [v]x a = v x a."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    none = np.zeros_like(x)
    rows = [[none, -z, y], [z, none, -x], [-y, x, none]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def view_steps(pose: Floats) -> Floats:
    """Return (6, 6) partials of dt, w by steps of the photo: C, and rho of A Exp(rho).

    R Exp(-F rho) is what A Exp(rho) makes of R; t = -R C.
    """
    return _steps(pose, pose[:3, :3])


def sensor_steps(pose: Floats) -> Floats:
    """Return (6, 6) partials of dt, w by steps of a sensor on a frame: c, and rho of A Exp(rho).

    A = F R'F and c = -F R't, so that t = -R F c.
    """
    return _steps(pose, pose[:3, :3] @ FLIP)


def _steps(pose: Floats, turned: Floats) -> Floats:
    found = np.zeros((6, 6))
    found[:3, :3] = -turned
    found[:3, 3:] = cross_matrices(pose[:3, 3]) @ FLIP
    found[3:, 3:] = -FLIP
    return found
