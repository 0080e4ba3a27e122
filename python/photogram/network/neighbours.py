"""Nearest points in a plane."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices


def mutually_nearest(points: Floats, predicted: Floats, limit: float) -> Indices:
    """Return the mutually nearest predicted point within a limit for each point; else -1."""
    found = _photocore.nearest_points(points, predicted, limit)
    back = _photocore.nearest_points(predicted, points, limit)
    mutual = (found >= 0) & (back[found] == np.arange(len(points))) if len(predicted) else found >= 0
    return np.where(mutual, found, -1)
