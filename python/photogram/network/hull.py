"""Convex hull of points in plan: corners, area, and points outside."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Floats

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
