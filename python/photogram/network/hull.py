"""The convex hull of points in plan: its corners, its area, and what lies outside."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Floats

MANY, DIRECTIONS = 1000, 16
ROUNDING = 1e-9  # Of the extent of a hull: a point that is no farther outside lies on it


def hull(points: Floats) -> Floats:
    """Return the (k, 2) corners of the convex hull of (n, 2) points, n at least 1, counterclockwise.

    Andrew's monotone chain. Points on a line have two corners, equal points up to two equal ones.
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
    """Return the points that are not well within the polygon of those farthest out in some directions.

    Of thousands few are left for the chain (Akl and Toussaint 1978).
    """
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
    """Return the area within the (k, 2) corners of a hull, in the square of their unit."""
    x, y = (corners - corners[0]).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


def outside(points: Floats, corners: Floats) -> Bools:
    """Return (n,) which of (n, 2) points lie outside the (k, 2) corners of a hull."""
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)
    extent = float(np.linalg.norm(np.ptp(corners, axis=0)))
    if not extent > 0:
        return np.asarray((points != corners[0]).any(axis=1))
    true = lengths > 0
    sides, corners = sides[true] / lengths[true, np.newaxis], corners[true]
    away = points[:, np.newaxis] - corners
    left = sides[:, 0] * away[..., 1] - sides[:, 1] * away[..., 0]
    # Of a hull without area the points beyond its ends lie on both of its sides.
    ahead = np.einsum("nkj,kj->nk", away, sides).max(axis=1) if len(corners) == 2 else 0.0
    return np.asarray((left.min(axis=1) < -ROUNDING * extent) | (ahead > extent * (1 + ROUNDING)))
