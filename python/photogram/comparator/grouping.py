"""Bringing the readings of each point together (subroutine GROUP)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from photogram.comparator.readings import Integers

__all__ = ["group", "group_as_listed"]


def group(points: Integers) -> Integers:
    """Return the order of readings in which equal points stand together, points and readings as measured."""
    _, first, inverse = np.unique(points, return_index=True, return_inverse=True)
    order: Integers = np.argsort(first[inverse], kind="stable")
    return order


def group_as_listed(points: Integers) -> Integers:
    """Return the order of readings that the listing makes.

    It brings later readings of a point forward by swapping, so that points which stood in the way end
    elsewhere: in figure 7 point 2 comes last, after the close-out on point 1 took its place.
    """
    order = list(range(len(points)))
    sorted_points = points.tolist()
    start = 0
    while start < len(order):
        end = start + 1
        for later in range(end, len(order)):
            if sorted_points[later] == sorted_points[start]:
                for values in (order, sorted_points):
                    values[end], values[later] = values[later], values[end]
                end += 1
        start = end
    return np.array(order, dtype=np.int64)
