"""Bringing the readings of each point together (subroutine GROUP)."""

from __future__ import annotations

from heapq import heappop, heappush
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from photogram.comparator.readings import Integers

__all__ = ["group", "group_as_listed", "rows_by_point"]


def group(points: Integers) -> Integers:
    """Return the order of readings in which equal points stand together, points and readings as measured."""
    _, first, inverse = np.unique(points, return_index=True, return_inverse=True)
    order: Integers = np.argsort(first[inverse], kind="stable")
    return order


def rows_by_point(points: Integers) -> list[tuple[int, Integers]]:
    """Return each point with the rows of its readings, points and rows in the order measured."""
    order = group(points)
    starts = np.flatnonzero(np.diff(points[order])) + 1
    rows = np.split(order, starts) if len(points) else []
    return list(zip(points[order[np.r_[0, starts]]].tolist() if rows else [], rows, strict=True))


def group_as_listed(points: Integers) -> Integers:
    """Return the order of readings that the listing makes.

    It brings later readings of a point forward by swapping, so that points which stood in the way end
    elsewhere: in figure 7 point 2 comes last, after the close-out on point 1 took its place.
    """
    order = list(range(len(points)))
    numbers = points.tolist()
    # Where the readings of each point stand; those before `start` have moved away.
    places: dict[int, list[int]] = {}
    for place, number in enumerate(numbers):
        places.setdefault(number, []).append(place)
    start = 0
    while start < len(order):
        own, end = places[numbers[start]], start
        while own:
            later = heappop(own)
            if later < start:
                continue
            if later > end:
                heappush(places[numbers[end]], later)
                order[end], order[later] = order[later], order[end]
                numbers[end], numbers[later] = numbers[later], numbers[end]
            end += 1
        start = end
    return np.array(order, dtype=np.int64)
