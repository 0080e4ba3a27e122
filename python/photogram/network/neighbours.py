"""The nearest of many points in a plane."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices


def mutually_nearest(points: Floats, predicted: Floats, limit: float) -> Indices:
    """Return for each point its mutually nearest predicted one within a limit; else -1."""
    found, back = nearest(points, predicted, limit), nearest(predicted, points, limit)
    mutual = (found >= 0) & (back[found] == np.arange(len(points))) if len(predicted) else found >= 0
    return np.where(mutual, found, -1)


def nearest(points: Floats, others: Floats, limit: float, but: Indices | None = None) -> Indices:
    """Return for each point the nearest of the others within a limit, -1 for none.

    `but` names for each point one of the others that does not count.
    """
    return _photocore.nearest_points(points, others, limit, but)
