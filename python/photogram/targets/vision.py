"""Axes of computer vision (x right, y down, z forward): poses as photos of a block have them, and images.

A pose is a (4, 4) matrix [R t; 0 1]: of a view, board -> camera 0; of a sensor, camera 0 -> camera k. Photos
have A = R'F and C = -R't, with F = diag(1, -1, -1). Steps of a pose are R <- Exp(w) R, t <- t + dt.
"""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera

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
    """Return (4, 4) the pose frame -> sensor of one with the position c and the attitude A on its frame."""
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


TURNED: Floats = np.diag(FLIP)  # vision axes to photo axes (x right, y up, z back) and back


@dataclass(frozen=True, eq=False)
class Imaged:
    """Images of n points with their partials; NaN where a point has none."""

    xy: Floats  # (n, 2) image coordinates
    by_point: Floats  # (n, 2, 3) by the point: Pi
    # (n, 2, p) by the parameters of the camera that are unknown, in their order, then by its unknown
    # knots: K
    by_parameters: Floats


def imaged(camera: Camera, points: Floats) -> Imaged:
    """Return the images of (n, 3) points, or directions, in the axes of a camera, with their partials."""
    xy, by_u, by_parameters = camera.partials(points * TURNED)
    return Imaged(xy, by_u * TURNED, by_parameters[:, :, unknown_of(camera)])


@dataclass(frozen=True, eq=False)
class Touched:
    """Images of n points by a lens of knots, with their partials by the k unknowns that each steps with."""

    xy: Floats  # As of :class:`Imaged`
    by_point: Floats
    columns: Indices  # (n, k) which of the p parameters and knots that are unknown
    by_columns: Floats  # (n, 2, k) by these


def touched(camera: Camera, points: Floats) -> Touched:
    """Return what :func:`imaged` does of a lens of knots, without the zeros: an image has 16 or 9 knots."""
    assert camera.knots is not None
    unknown, count = unknown_of(camera), len(camera.names)
    u = points * TURNED
    xy, by_u, own = _photocore.camera_partials(camera.model, camera.values, u, camera.knots)
    knots, weights = _photocore.camera_patches(camera.model, camera.values, u)
    core = np.flatnonzero(unknown[:count])
    both = count + (2 * knots[:, :, np.newaxis] + np.arange(2)).reshape(len(points), -1)
    places = np.where(unknown, np.cumsum(unknown) - 1, 0)
    columns = np.hstack([np.broadcast_to(np.arange(len(core)), (len(points), len(core))), places[both]])
    found = np.zeros((len(points), 2, columns.shape[1]))
    found[:, :, : len(core)] = own[:, :, core]
    # d image / d knot = diag(fx, fy) times its weight.
    for axis, scale in enumerate(camera.values[:2].tolist()):
        free = unknown[both[:, axis::2]]
        found[:, axis, len(core) + axis :: 2] = np.where(free, scale * weights, 0.0)
    return Touched(xy, by_u * TURNED, columns, found)


def has_unknown_knots(camera: Camera) -> bool:
    """Whether there are knots among what is unknown of a camera."""
    return bool(unknown_of(camera)[len(camera.names) :].any())


def unknown_of(camera: Camera) -> Bools:
    """Return which parameters of a camera are unknown, and behind them which of its knots."""
    unknown = camera.deviations > 0
    if camera.knots is None:
        return unknown
    knots = np.zeros(camera.knots.size, dtype=bool)
    if camera.knot_sd is not None:
        knots = camera.knot_sd.any(axis=2).repeat(2)
    return np.append(unknown, knots)


def values_of(camera: Camera) -> Floats:
    """Return the parameters of a camera, and behind them its knots."""
    return camera.values if camera.knots is None else np.append(camera.values, camera.knots)


def rays(camera: Camera, pixels: Floats) -> Floats:
    """Return (n, 3) unit vectors, in the axes of a camera, to where (n, 2) pixels look; NaN without."""
    return np.asarray(camera.rays(pixels) * TURNED)


def motion_partials(points: Floats, finite: bool = True) -> Floats:
    """Return (n, 3, 6) G = (I, -[p]x): what a motion (dt, w) of all points does to each of (n, 3).

    Points at infinity, which are directions, do not feel the translation.
    """
    by_translation = np.broadcast_to(np.eye(3) if finite else np.zeros((3, 3)), (len(points), 3, 3))
    return np.concatenate([by_translation, -cross_matrices(points)], axis=2)
