"""The nearest of many points in a plane."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats, Indices

__all__ = ["mutually_nearest", "nearest"]


def mutually_nearest(points: Floats, predicted: Floats, limit: float) -> Indices:
    """Return for each point its mutually nearest predicted one within a limit; else -1."""
    found, back = nearest(points, predicted, limit), nearest(predicted, points, limit)
    mutual = (found >= 0) & (back[found] == np.arange(len(points))) if len(predicted) else found >= 0
    return np.where(mutual, found, -1)


def nearest(points: Floats, others: Floats, limit: float, but: Indices | None = None) -> Indices:
    """Return for each point the nearest of the others within a limit, -1 for none.

    `but` names for each point one of the others that does not count.

    The others are sorted into cells as wide as the limit, so that only nine cells are searched.
    """
    best, least = np.full(len(points), -1, np.int64), np.full(len(points), limit**2)
    if not len(others):
        return best
    corner = others.min(axis=0)
    cells = np.floor((others - corner) / limit).astype(np.int64) + 1
    width = int(cells[:, 1].max()) + 2
    order = np.argsort(cells @ [width, 1], kind="stable")
    keys = (cells @ [width, 1])[order]
    own = np.floor((points - corner) / limit).astype(np.int64) + 1
    inside = np.flatnonzero(((own >= 0) & (own <= cells.max(axis=0) + 1)).all(axis=1))
    for step in (-width - 1, -width, -width + 1, -1, 0, 1, width - 1, width, width + 1):
        wanted = own[inside] @ [width, 1] + step
        first, last = (np.searchsorted(keys, wanted, side) for side in ("left", "right"))
        for k in range(int((last - first).max(initial=0))):
            here = first + k < last
            point, other = inside[here], order[first[here] + k]
            square = np.sum((points[point] - others[other]) ** 2, axis=1)
            nearer = square <= least[point]
            if but is not None:
                nearer &= other != but[point]
            best[point[nearer]], least[point[nearer]] = other[nearer], square[nearer]
    return best
