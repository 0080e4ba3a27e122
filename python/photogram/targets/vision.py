"""Vision axes (x right, y down, z forward): conversion of poses to photos of a block, and images.

A pose is a (4, 4) matrix [R t; 0 1]: board -> camera 0 for a view, camera 0 -> camera k for a sensor. Photos
have A = R'F and C = -R't, with F = diag(1, -1, -1). Steps of a pose are R <- Exp(w) R, t <- t + dt.
"""

from __future__ import annotations

from collections.abc import Sequence

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
    """Return (n, 4, 4) the poses of photos with positions C and attitudes A."""
    return composed(attitudes.values("matrix_to_vision"), attitudes.translations(positions))


def of_vectors(vectors: Floats) -> Floats:
    """Return (n, 4, 4) poses of (n, 6) rotation vectors and translations."""
    attitudes = Attitudes.of("rotation_vector_to_vision", vectors[:, :3])
    return composed(attitudes.values("matrix_to_vision"), vectors[:, 3:])


def inverted(pose: Floats) -> Floats:
    """Return the inverse (4, 4) of a pose: [R' -R't; 0 1]."""
    turned = pose[:3, :3].T
    return composed(turned, -turned @ pose[:3, 3])


def transformed(poses: Floats, points: Floats) -> Floats:
    """Transform (n, 3) points by one pose (4, 4), or by one each (n, 4, 4)."""
    return np.asarray(np.einsum("...ij,...j->...i", poses[..., :3, :3], points) + poses[..., :3, 3])


def sensor_pose(position: Floats, attitude: Floats) -> Floats:
    """Return (4, 4) the pose frame -> sensor from position c and attitude A."""
    rotation = FLIP @ attitude.T @ FLIP
    return composed(rotation, -rotation @ FLIP @ position)


def moved_by(pose: Floats, step: Floats) -> Floats:
    """Return (4, 4) a pose after a small motion (dt, w): p <- Exp(w) p + dt."""
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

    A Exp(rho) corresponds to R Exp(-F rho); t = -R C.
    """
    return _steps(pose, pose[:3, :3])


def sensor_steps(pose: Floats) -> Floats:
    """Return (6, 6) partials of dt, w by steps of a sensor: c, and rho of A Exp(rho).

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
    """Projections of n points with their partials; NaN if undefined."""

    xy: Floats  # (n, 2) image coordinates
    by_point: Floats  # (n, 2, 3) by the point: Pi
    # (n, 2, p) by the unknown parameters of the camera, then by its unknown knots: K
    by_parameters: Floats
    # (n, k) numbers of the k unknowns that affect each point, to which (n, 2, k) partials refer; None: all
    columns: Indices | None = None


def imaged(camera: Camera, points: Floats) -> Imaged:
    """Return projections of (n, 3) points or directions in camera axes, with partials."""
    xy, by_u, by_parameters = camera.partials(points * TURNED)
    return Imaged(xy, by_u * TURNED, by_parameters[:, :, unknown_of(camera)])


def touched(camera: Camera, points: Floats) -> Imaged:
    """Return :func:`imaged` of a splined lens without zeros (16 or 9 knots per point)."""
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
    return Imaged(xy, by_u * TURNED, found, columns)


def unknown_of(camera: Camera) -> Bools:
    """Return which parameters of a camera, followed by its knots, are unknown."""
    unknown = camera.deviations > 0
    if camera.knots is None:
        return unknown
    knots = np.zeros(camera.knots.size, dtype=bool)
    if camera.knot_sd is not None:
        knots = camera.knot_sd.any(axis=2).repeat(2)
    return np.append(unknown, knots)


def names_of(camera: Camera) -> tuple[str, ...]:
    """Return the names of the parameters of a camera, followed by its knots."""
    return camera.names + camera.knot_names


def values_of(camera: Camera) -> Floats:
    """Return the parameters of a camera, followed by its knots."""
    return camera.values if camera.knots is None else np.append(camera.values, camera.knots)


def rays(camera: Camera, pixels: Floats) -> Floats:
    """Return (n, 3) unit rays of (n, 2) pixels in camera axes; NaN if undefined."""
    return np.asarray(camera.rays(pixels) * TURNED)


def points_at(camera: Camera, pixels: Floats, distances: Sequence[float]) -> Floats:
    """Return (D n, 3) points on pixel rays at each distance; directions at infinity."""
    towards = rays(camera, pixels)
    return np.concatenate([towards * (each if np.isfinite(each) else 1.0) for each in distances])


def motion_partials(points: Floats, finite: bool | Bools = True) -> Floats:
    """Return (n, 3, 6) G = (I, -[p]x), the effect of a motion (dt, w) on points.

    Points at infinity, which are directions, are not affected by the translation.
    """
    by_translation = np.broadcast_to(np.eye(3) * np.reshape(finite, (-1, 1, 1)), (len(points), 3, 3))
    return np.concatenate([by_translation, -cross_matrices(points)], axis=2)
