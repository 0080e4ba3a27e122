"""Planes seen by cameras: homographies of pixels and rays, the focal lengths and poses that they say.

Arrays stand as pictures by points of the board: (P, n, 2) pixels or (P, n, 3) rays, NaN where a point was
not seen. Axes are those of vision: x right, y down, z forward.
"""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Bools, Floats

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
    """Return the homography of the board's plane to each picture, by direct linear transformation.

    Both sides are counted from their centroids and scaled to a mean distance of sqrt 2.

    Parameters
    ----------
    places
        (n, 2) places of the points in the plane of the board.
    xy
        (P, n, 2) pixels; NaN where not seen. Each picture has four at least, no three of them on a line.

    Returns
    -------
    (P, 3, 3), each of norm 1 in the scaled coordinates; the sign is not defined.
    """
    seen = np.isfinite(xy[..., 0])
    plane, of_plane = _scaled(np.broadcast_to(places, xy.shape), seen)
    image, of_image = _scaled(xy, seen)
    found = _smallest(_equations(plane, _with_one(image))[:, :, :2], seen)
    made: Floats = np.linalg.inv(of_image) @ found @ of_plane
    return made


def ray_homographies(places: Floats, rays: Floats) -> Floats:
    """Return the homography of the board's plane to the rays of each picture: ray x H (x, y, 1) = 0.

    Parameters
    ----------
    places
        (n, 2) places of the points in the plane of the board.
    rays
        (P, n, 3) of length 1; NaN where not seen.

    Returns
    -------
    (P, 3, 3) with the sign by which most points lie on the side of their rays.
    """
    seen = np.isfinite(rays[..., 0])
    plane, of_plane = _scaled(np.broadcast_to(places, (*rays.shape[:2], 2)), seen)
    found = np.matmul(_smallest(_equations(plane, rays), seen), of_plane)
    towards = np.einsum("pni,pij,nj->pn", np.nan_to_num(rays), found, _with_one(places))
    found *= np.where(towards.sum(axis=1) < 0, -1.0, 1.0)[:, np.newaxis, np.newaxis]
    return found


def angles_apart(places: Floats, rays: Floats, found: Floats) -> Floats:
    """Return (P, n) the angles (rad) between rays and H (x, y, 1); NaN where not seen."""
    there = np.einsum("pij,nj->pni", found, _with_one(places))
    across = np.linalg.norm(np.cross(rays, there), axis=-1)
    return np.arctan2(across, np.einsum("pni,pni->pn", rays, there))


def focal_lengths(found: Floats, middle: Floats) -> tuple[float, float, float]:
    """Return fx, fy, and a single f, of a perspective camera by its homographies; NaN where they say none.

    With g = T(-middle) H and its first columns a, b, whose directions in space are at right angles and of one
    length: two equations of each picture in X = 1/fx^2, Y = 1/fy^2,

        a1 b1 X + a2 b2 Y = -a3 b3,    (a1^2 - b1^2) X + (a2^2 - b2^2) Y = -(a3^2 - b3^2).

    Parameters
    ----------
    found
        (P, 3, 3) homographies to pixels.
    middle
        (2,) the principal point.
    """
    own = found.copy()
    own[:, :2] -= middle[:, np.newaxis] * found[:, 2:]
    a, b = own[:, :, 0], own[:, :, 1]
    weight = 1 / (np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1))[:, np.newaxis]
    rows = np.concatenate([a * b * weight, (a * a - b * b) * weight])
    both = np.linalg.lstsq(rows[:, :2], -rows[:, 2], rcond=None)[0]
    one = np.linalg.lstsq(rows[:, :2].sum(axis=1, keepdims=True), -rows[:, 2], rcond=None)[0]
    fx, fy, f = (1 / math.sqrt(each) if each > 0 else math.nan for each in [*both.tolist(), float(one[0])])
    return fx, fy, f


def poses(found: Floats) -> Floats:
    """Return (P, 4, 4) poses board -> camera of homographies to rays, whose sign says the side.

    The scale is the mean length of the first two columns, the third axis their cross product, the attitude
    the nearest rotation.
    """
    scale = np.linalg.norm(found[:, :, :2], axis=1).mean(axis=1)
    own = found / scale[:, np.newaxis, np.newaxis]
    third = np.cross(own[:, :, 0], own[:, :, 1])
    made = np.tile(np.eye(4), (len(found), 1, 1))
    made[:, :3, :3] = nearest_rotations(np.stack([own[:, :, 0], own[:, :, 1], third], axis=2))
    made[:, :3, 3] = own[:, :, 2]
    return made


def nearest_rotations(matrices: Floats) -> Floats:
    """Return (k, 3, 3) the rotations nearest to matrices."""
    left, _, right = np.linalg.svd(matrices)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, np.newaxis]
    found: Floats = left @ right
    return found


def centres(of_boards: Floats) -> Floats:
    """Return (P, 3) where the cameras are in the axes of the board, C = -R't."""
    found: Floats = -np.einsum("pji,pj->pi", of_boards[:, :3, :3], of_boards[:, :3, 3])
    return found


def frontal_tilts(of_boards: Floats) -> Floats:
    """Return (P,) the angles (rad) by which boards are tilted out of parallel with the image."""
    third = of_boards[:, :3, 2]
    return np.arctan2(np.hypot(third[:, 0], third[:, 1]), np.abs(third[:, 2]))


def _with_one(points: Floats) -> Floats:
    return np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1)


def _scaled(points: Floats, seen: Bools) -> tuple[Floats, Floats]:
    """Return (P, n, 2) points scaled to a mean distance of sqrt 2 from their centroids, and (P, 3, 3) how."""
    kept = np.where(seen[..., np.newaxis], points, np.nan)
    middle = np.nanmean(kept, axis=1)
    apart = kept - middle[:, np.newaxis]
    scale = math.sqrt(2) / np.nanmean(np.linalg.norm(apart, axis=-1), axis=1)
    made = np.zeros((len(points), 3, 3))
    made[:, 0, 0] = made[:, 1, 1] = scale
    made[:, :2, 2] = -scale[:, np.newaxis] * middle
    made[:, 2, 2] = 1
    return apart * scale[:, np.newaxis, np.newaxis], made


def _equations(plane: Floats, rays: Floats) -> Floats:
    """Return (P, n, 3, 9) the rows of ray x H b = 0, b = (x, y, 1), in the elements of H row by row."""
    x, y, z = (rays[..., k, np.newaxis] for k in range(3))
    b = _with_one(plane)
    zero = np.zeros_like(b)
    rows = (
        np.concatenate([zero, -z * b, y * b], axis=-1),
        np.concatenate([z * b, zero, -x * b], axis=-1),
        np.concatenate([-y * b, x * b, zero], axis=-1),
    )
    return np.stack(rows, axis=2)


def _smallest(rows: Floats, seen: Bools) -> Floats:
    """Return (P, 3, 3) the H of norm 1 that make rows as small as they come: (P, n, k, 9) of points seen."""
    used = np.where(seen[..., np.newaxis, np.newaxis], rows, 0.0).reshape(len(rows), -1, 9)
    _, vectors = np.linalg.eigh(used.transpose(0, 2, 1) @ used)
    found: Floats = vectors[:, :, 0].reshape(-1, 3, 3)
    return found
