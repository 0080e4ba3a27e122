"""Cameras of a rig from the views that they have in common: poses, and corners that were listed turned."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.targets.homographies import nearest_rotations
from photogram.targets.vision import composed, inverted

__all__ = ["Rig", "connected", "mean_pose"]

AGREE = 0.2
"""Radians, or parts of the distance of boards: poses that are apart by less are of one sensor."""
UNTURNED = 1e-3
"""The same: what a pose without a turn of the board may be worse, to be taken before one with a turn."""


@dataclass(frozen=True, eq=False)
class Rig:
    """K cameras, as far as they have views in common.

    Attributes
    ----------
    sensors
        (K, 4, 4) from the reference of a camera to the camera.
    references
        (K,) which camera that is: the first of those that hang together.
    turned
        (P,) the order of `turns` in which corners of each picture were listed; 0 where they were not.
    apart
        (P,) whether a picture agrees with no pose of its camera on the rig.
    """

    sensors: Floats
    references: Indices
    turned: Indices
    apart: Bools


def connected(poses: Floats, cameras: Indices, views: Indices, count: int, turns: dict[int, Floats]) -> Rig:
    """Return the poses of cameras on their rig, each by the one before with which it has most views.

    Parameters
    ----------
    poses
        (P, 4, 4) board -> camera of each picture; NaN where it is not known.
    cameras, views
        (P,) of each picture.
    count
        K.
    turns
        Turns of the board that are not seen, by their orders; order 0 is none.
    """
    sensors, references = np.tile(np.eye(4), (count, 1, 1)), np.full(count, -1)
    found, turned = poses.copy(), np.zeros(len(poses), dtype=np.int64)
    apart = np.zeros(len(poses), dtype=bool)
    known = np.isfinite(poses).all(axis=(1, 2))
    seen = np.full((count, int(views.max(initial=-1)) + 1), -1)
    seen[cameras[known], views[known]] = np.flatnonzero(known)
    common = (seen >= 0).astype(np.int64) @ (seen >= 0).T
    while (references < 0).any():
        done, rest = np.flatnonzero(references >= 0), np.flatnonzero(references < 0)
        shared = common[np.ix_(done, rest)]
        if not shared.any():
            references[rest[0]] = rest[0]
            continue
        before, own = (int(k) for k in np.unravel_index(np.argmax(shared), shared.shape))
        before, own = int(done[before]), int(rest[own])
        both = np.flatnonzero((seen[before] >= 0) & (seen[own] >= 0))
        first, second = seen[before, both], seen[own, both]
        step, orders, away = _relation(found[first], found[second], turns)
        references[own], sensors[own] = references[before], step @ sensors[before]
        turned[second], apart[second] = orders, away
        for order, turn in turns.items():
            rows = second[orders == order]
            found[rows] = found[rows] @ inverted(turn)
    return Rig(sensors, references, turned, apart)


def mean_pose(poses: Floats) -> Floats:
    """Return the (4, 4) chordal mean of the attitudes of poses with the median of their translations."""
    rotation = nearest_rotations(poses[:, :3, :3].mean(axis=0)[np.newaxis])[0]
    return composed(rotation, np.median(poses[:, :3, 3], axis=0))


def _relation(first: Floats, second: Floats, turns: dict[int, Floats]) -> tuple[Floats, Indices, Bools]:
    """Return the pose of a second camera by a first, turns of its (m) boards, and which boards disagree.

    Each board gives a pose for each turn. All boards share one: that which is nearest to one of each.
    """
    orders = np.array([*turns])
    turned = second[:, np.newaxis] @ np.linalg.inv(np.array([*turns.values()]))
    poses = turned @ np.linalg.inv(first)[:, np.newaxis]
    far = float(np.median(np.linalg.norm(first[:, :3, 3], axis=1)))
    scores = np.empty(poses.shape[:2])
    for board, turn in np.ndindex(*scores.shape):
        nearest = _apart(poses, poses[board, turn], far).min(axis=1)
        scores[board, turn] = np.minimum(nearest, AGREE).mean()
    scores[:, 1:] += UNTURNED
    best = poses[np.unravel_index(np.argmin(scores), scores.shape)]
    distances = _apart(poses, best, far)
    chosen = np.argmin(distances + UNTURNED * (orders > 0), axis=1)
    rows = np.arange(len(poses))
    agree = distances[rows, chosen] < AGREE
    return mean_pose(poses[rows, chosen][agree]), orders[np.where(agree, chosen, 0)], ~agree


def _apart(poses: Floats, other: Floats, far: float) -> Floats:
    """Return how far (..., 4, 4) poses are from another: chords of attitudes, shifts over a length."""
    turns = np.linalg.norm(poses[..., :3, :3] - other[:3, :3], axis=(-2, -1)) / math.sqrt(2)
    shifts = np.linalg.norm(poses[..., :3, 3] - other[:3, 3], axis=-1) / far
    return np.asarray(turns + shifts)
