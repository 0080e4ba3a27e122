"""Sets of points: convex hulls, nearest points, strips of photos, and similarity transformations."""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices

MANY, DIRECTIONS = 1000, 16
ROUNDING = 1e-9  # Tolerance of points on a hull, relative to its extent


def hull(points: Floats) -> Floats:
    """Return the (k, 2) corners of the convex hull of (n, 2) points, n at least 1, counterclockwise.

    Andrew's monotone chain. Points on a line have two corners; equal points may have two equal corners.
    """
    points = _outermost(points)
    order = points[np.lexsort((points[:, 1], points[:, 0]))].tolist()

    def chain(ordered: list[list[float]]) -> list[list[float]]:
        kept: list[list[float]] = []
        for x, y in ordered:
            while len(kept) > 1:
                (x0, y0), (x1, y1) = kept[-2:]
                if (x1 - x0) * (y - y0) > (y1 - y0) * (x - x0):
                    break
                kept.pop()
            kept.append([x, y])
        return kept

    return np.array(chain(order)[:-1] + chain(order[::-1])[:-1] or order[:1])


def _outermost(points: Floats) -> Floats:
    """Discard points well inside the polygon of extreme points (Akl and Toussaint 1978)."""
    if len(points) < MANY:
        return points
    turns = np.linspace(0.0, 2 * np.pi, DIRECTIONS, endpoint=False)
    farthest = [int(np.argmax(points @ (np.cos(turn), np.sin(turn)))) for turn in turns]
    corners = points[list(dict.fromkeys(farthest))]
    within = np.full(len(points), len(corners) > 2)
    for first, last in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        x, y = last - first
        within &= x * (points[:, 1] - first[1]) - y * (points[:, 0] - first[0]) > 0
    return np.asarray(points[~within])


def area(corners: Floats) -> float:
    """Return the area of a hull with (k, 2) corners, in the square of their unit."""
    x, y = (corners - corners[0]).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


def outside(points: Floats, corners: Floats) -> Bools:
    """Return (n,) whether (n, 2) points are outside the (k, 2) corners of a hull."""
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)
    extent = float(np.linalg.norm(np.ptp(corners, axis=0)))
    if not extent > 0:
        return np.asarray((points != corners[0]).any(axis=1))
    true = lengths > 0
    sides, corners = sides[true] / lengths[true, np.newaxis], corners[true]
    away = points[:, np.newaxis] - corners
    left = sides[:, 0] * away[..., 1] - sides[:, 1] * away[..., 0]
    # Points beyond the ends of a hull without area are on both of its sides.
    ahead = np.einsum("nkj,kj->nk", away, sides).max(axis=1) if len(corners) == 2 else 0.0
    return np.asarray((left.min(axis=1) < -ROUNDING * extent) | (ahead > extent * (1 + ROUNDING)))


def mutually_nearest(points: Floats, predicted: Floats, limit: float) -> Indices:
    """Return the mutually nearest predicted point within a limit for each point; else -1."""
    found = _photocore.nearest_points(points, predicted, limit)
    back = _photocore.nearest_points(predicted, points, limit)
    mutual = (found >= 0) & (back[found] == np.arange(len(points))) if len(predicted) else found >= 0
    return np.where(mutual, found, -1)


def strips_of(positions: Floats) -> list[Indices]:
    """Divide photos at (P, 3) in metric axes, in order, into strips at curves and gaps."""
    steps = np.linalg.norm(np.diff(positions[:, :2], axis=0), axis=1)
    usual = float(np.median(steps)) if steps.size else 0.0
    plan = [complex(x, y) for x, y in positions[:, :2].tolist()]

    def follows(before: int, start: int, next_: int, gaps: int) -> bool:
        step = plan[next_] - plan[before]
        if abs(step) > 2.5 * gaps * usual:
            return False
        course = plan[before] - plan[start]
        # Within 45 degrees of the course so far.
        along = (step * course.conjugate()).real
        return before == start or along > math.sqrt(0.5) * abs(step) * abs(course)

    strips: list[list[int]] = []
    last = 0
    for photo in range(len(plan)):
        if strips and follows(last, strips[-1][0], photo, photo - last):
            strips[-1].append(photo)
            last = photo
        # A single deviating photo does not end a strip if the next one is on course.
        elif (
            strips
            and len(strips[-1]) > 1
            and last == photo - 1
            and photo + 1 < len(plan)
            and follows(last, strips[-1][0], photo + 1, 2)
        ):
            strips[-1].append(photo)
        else:
            strips.append([photo])
            last = photo
    return [np.array(strip, dtype=np.int64) for strip in strips]


LINE = 1e-9  # Points with a smaller ratio of extents across and along a line are collinear


def turn_and_scale(model: Floats, targets: Floats) -> tuple[float, Floats, Floats]:
    """Return scale and rotation of the unweighted best fit about the means, and singular values.

    The second singular value of the sum of products is about 0 for collinear points, and the rotation is
    arbitrary. All singular values are 0 if products overflow.
    """
    a, b = model - model.mean(axis=0), targets - targets.mean(axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        products = b.T @ a
    if not np.isfinite(products).all():
        return 1.0, np.eye(3), np.zeros(3)
    left, sizes, right = np.linalg.svd(products)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right)) or 1.0])
    scale = float((sizes * signs).sum() / max((a**2).sum(), np.finfo(np.float64).tiny))
    return scale, (left * signs) @ right, sizes


def similarity(model: Floats, targets: Floats) -> tuple[float, Floats, Floats, float]:
    """Return scale, rotation, translation and rms misfit of the similarity between points.

    The misfit is infinite if the points do not determine the transformation.
    """
    scale, turn, sizes = turn_and_scale(model, targets)
    if sizes[1] < LINE * sizes[0] or not sizes[0] > 0:
        return 1.0, np.eye(3), np.zeros(3), np.inf
    middle, aim = model.mean(axis=0), targets.mean(axis=0)
    left = targets - aim - scale * (model - middle) @ turn.T
    return scale, turn, aim - scale * turn @ middle, float(np.sqrt(np.mean(left**2)))
