"""Collections that several benchmarks adjust."""

from __future__ import annotations

from photogram import collection
from photogram.collection import Collection


def rings(photos: int) -> Collection:
    """Return photos around a cube full of points, each of which is seen from everywhere."""
    return collection.simulate(photos=photos, points=2000, seen=min(0.7, 40 / photos), seed=1).collection
