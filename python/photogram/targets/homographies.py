"""Targets seen by cameras: homographies of pixels and rays, the focal lengths and poses that they say.

Arrays stand as pictures by points of the board: (P, n, 2) pixels or (P, n, 3) rays, NaN where a point was
not seen. Places of points have two coordinates, in the plane of a flat board, or three: m. Axes are those of
vision: x right, y down, z forward.
"""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.targets.vision import composed

__all__ = [
    "angles_apart",
    "centres",
    "focal_lengths",
    "frontal_tilts",
    "homographies",
    "nearest_rotations",
    "poses",
    "ray_homographies",
]


def homographies(places: Floats, xy: Floats) -> Floats:
    """Return (P, 3, m + 1) the homography of the board to each picture, by direct linear transformation.

    Both sides are counted from their centroids and scaled to a mean distance of sqrt 2, in space of sqrt 3;
    in these each has norm 1, and no sign. Places are (n, m), pixels (P, n, 2), NaN where not seen: each
    picture has four points of a plane at least, no three of them on a line; else six, not in a plane.
    """
    seen = np.isfinite(xy[..., 0])
    board, of_board = _scaled(np.broadcast_to(places, (len(xy), *places.shape)), seen)
    image, of_image = _scaled(xy, seen)
    found = _smallest(_equations(board, _with_one(image))[:, :, :2], seen)
    return np.asarray(np.linalg.inv(of_image) @ found @ of_board)


def ray_homographies(places: Floats, rays: Floats) -> Floats:
    """Return (P, 3, m + 1) homographies of the board to rays: ray x H (x, y, 1) = 0, or (x, y, z, 1).

    Places are (n, m), rays (P, n, 3) of length 1, NaN where not seen. The sign is that by which most points
    lie on the side of their rays.
    """
    seen = np.isfinite(rays[..., 0])
    board, of_board = _scaled(np.broadcast_to(places, (len(rays), *places.shape)), seen)
    found: Floats = _smallest(_equations(board, rays), seen) @ of_board
    towards = np.einsum("pni,pij,nj->pn", np.nan_to_num(rays), found, _with_one(places))
    found *= np.where(towards.sum(axis=1) < 0, -1.0, 1.0)[:, np.newaxis, np.newaxis]
    return found


def angles_apart(places: Floats, rays: Floats, found: Floats) -> Floats:
    """Return (P, n) the angles (rad) between rays and what H makes of places; NaN where not seen."""
    there = np.einsum("pij,nj->pni", found, _with_one(places))
    across = np.linalg.norm(np.cross(rays, there), axis=-1)
    return np.asarray(np.arctan2(across, np.einsum("pni,pni->pn", rays, there)))


def focal_lengths(found: Floats, middle: Floats) -> tuple[float, float, float]:
    """Return fx, fy, and a single f, of a perspective camera by its homographies; NaN where they say none.

    With g = T(-middle) H and its first columns a, b, whose directions in space are at right angles and of one
    length: two equations of each picture in X = 1/fx^2, Y = 1/fy^2,

        a1 b1 X + a2 b2 Y = -a3 b3,    (a1^2 - b1^2) X + (a2^2 - b2^2) Y = -(a3^2 - b3^2).

    Homographies are (P, 3, m + 1) to pixels; of points that lie in no plane each has a camera matrix, with a
    principal point of its own, else it is the (2,) middle.
    """
    own = found.copy()
    own[:, :2] -= middle[:, np.newaxis] * found[:, 2:]
    if own.shape[2] == 4:
        return _of_matrices(own[:, :, :3])
    a, b = own[:, :, 0], own[:, :, 1]
    weight = 1 / (np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1))[:, np.newaxis]
    rows = np.concatenate([a * b * weight, (a * a - b * b) * weight])
    both = np.linalg.lstsq(rows[:, :2], -rows[:, 2], rcond=None)[0]
    one = np.linalg.lstsq(rows[:, :2].sum(axis=1, keepdims=True), -rows[:, 2], rcond=None)[0]
    fx, fy, f = (1 / math.sqrt(each) if each > 0 else math.nan for each in [*both.tolist(), float(one[0])])
    return fx, fy, f


def _of_matrices(matrices: Floats) -> tuple[float, float, float]:
    """Return fx, fy and their mean by (P, 3, 3) K R with rows a, b, c: a'a/c'c = fx^2 + cx^2; medians."""
    lengths = np.sum(matrices[:, 2] ** 2, axis=1)[:, np.newaxis]
    squares = np.sum(matrices[:, :2] ** 2, axis=2) / lengths
    centre = matrices[:, :2] @ matrices[:, 2, :, np.newaxis]
    fx, fy = np.sqrt(np.median(squares - (centre[..., 0] / lengths) ** 2, axis=0)).tolist()
    return fx, fy, (fx + fy) / 2


def poses(found: Floats) -> Floats:
    """Return (P, 4, 4) poses board -> camera of (P, 3, m + 1) homographies to rays, whose sign says the side.

    The scale is the mean length of the columns before the last, the third axis of a plane their cross
    product, the attitude the nearest rotation.
    """
    scale = np.linalg.norm(found[:, :, :-1], axis=1).mean(axis=1)
    own = found / scale[:, np.newaxis, np.newaxis]
    axes = own[:, :, :3]
    if found.shape[2] == 3:
        axes = np.stack([own[:, :, 0], own[:, :, 1], np.cross(own[:, :, 0], own[:, :, 1])], axis=2)
    return composed(nearest_rotations(axes), own[:, :, -1])


def nearest_rotations(matrices: Floats) -> Floats:
    """Return (k, 3, 3) the rotations nearest to matrices."""
    left, _, right = np.linalg.svd(matrices)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, np.newaxis]
    return np.asarray(left @ right)


def centres(of_boards: Floats) -> Floats:
    """Return (P, 3) where the cameras are in the axes of the board, C = -R't."""
    return np.asarray(-np.einsum("pji,pj->pi", of_boards[:, :3, :3], of_boards[:, :3, 3]))


def frontal_tilts(of_boards: Floats) -> Floats:
    """Return (P,) the angles (rad) by which boards are tilted out of parallel with the image."""
    third = of_boards[:, :3, 2]
    return np.arctan2(np.hypot(third[:, 0], third[:, 1]), np.abs(third[:, 2]))


def _with_one(points: Floats) -> Floats:
    return np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1)


def _scaled(points: Floats, seen: Bools) -> tuple[Floats, Floats]:
    """Return (P, n, m) points scaled to a mean distance of sqrt m from their centroids, and matrices: how."""
    m = points.shape[2]
    kept = np.where(seen[..., np.newaxis], points, np.nan)
    middle = np.nanmean(kept, axis=1)
    apart = kept - middle[:, np.newaxis]
    scale = math.sqrt(m) / np.nanmean(np.linalg.norm(apart, axis=-1), axis=1)
    made = np.tile(np.eye(m + 1), (len(points), 1, 1))
    made[:, :m, :m] *= scale[:, np.newaxis, np.newaxis]
    made[:, :m, m] = -scale[:, np.newaxis] * middle
    return apart * scale[:, np.newaxis, np.newaxis], made


def _equations(board: Floats, rays: Floats) -> Floats:
    """Return (P, n, 3, 3 (m + 1)) the rows of ray x H b = 0 in the elements of H; b is a place and 1."""
    x, y, z = (rays[..., k, np.newaxis] for k in range(3))
    b = _with_one(board)
    zero = np.zeros_like(b)
    rows = (
        np.concatenate([zero, -z * b, y * b], axis=-1),
        np.concatenate([z * b, zero, -x * b], axis=-1),
        np.concatenate([-y * b, x * b, zero], axis=-1),
    )
    return np.stack(rows, axis=2)


def _smallest(rows: Floats, seen: Bools) -> Floats:
    """Return (P, 3, m + 1) the H of norm 1 that make rows (P, n, k, 3 (m + 1)) of points seen least."""
    used = np.where(seen[..., np.newaxis, np.newaxis], rows, 0.0).reshape(len(rows), -1, rows.shape[-1])
    _, vectors = np.linalg.eigh(used.transpose(0, 2, 1) @ used)
    return np.asarray(vectors[:, :, 0].reshape(len(rows), 3, -1))
