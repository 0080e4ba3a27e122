"""Where a point lies in a block: in a corner, at an edge, in the interior.

The place in the block, not the distance to control: it is the same for every pattern of control, so that the
rows of two patterns hold the same points, and it is how the accuracy of blocks is usually tabulated: weak at
the border, where rays are few and come from one side, uniform inside.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.network.hull import hull

__all__ = ["LOCATIONS", "locations"]


LOCATIONS = ("corner", "edge", "interior")


def locations(points: Floats, stations: Floats) -> NDArray[np.str_]:
    """Return the location of each of (n, 2) points in plan, (n,): one of `LOCATIONS`.

    The block is the smallest rectangle around its (P, 2) photo stations, P at least 1. A point in it lies in
    the interior, one beyond a side of it at an edge, one beyond two sides in a corner. So a single strip has
    flanks and ends, but hardly an interior.
    """
    axes = _axes(stations)
    turned, extent = points @ axes.T, stations @ axes.T
    beyond = (turned < extent.min(axis=0)) | (turned > extent.max(axis=0))
    found: NDArray[np.str_] = np.array(LOCATIONS)[2 - beyond.sum(axis=1)]
    return found


def _axes(points: Floats) -> Floats:
    """Rows: the unit vectors along the sides of the smallest rectangle around points in plan.

    One of its sides lies along a side of the convex hull (Freeman and Shapira, 1975).
    """
    corners = hull(points)
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)
    if not (lengths > 0).any():
        return np.eye(2)
    c, s = (sides[lengths > 0] / lengths[lengths > 0, np.newaxis]).T
    frames = np.stack([np.stack([c, s], axis=1), np.stack([-s, c], axis=1)], axis=1)
    extents = np.ptp(np.einsum("kij,nj->kin", frames, corners), axis=2)
    axes: Floats = frames[np.argmin(extents.prod(axis=1))]
    return axes
