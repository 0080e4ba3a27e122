"""The coordinates from which photogram starts its points, so that a peer can start from the same."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram import Block
from photogram.network.rays import Rays

Floats = NDArray[np.float64]


def intersections(block: Block) -> Floats:
    """Intersect the initial rays of every point of a block in rectangular space, (n, 3).

    The sum of the squared distances from the rays is least: sum of (I - d d^T) (P - C) = 0 for projection
    centres C and directions d of unit length. Held components of control stay as they are.
    """
    rays = Rays.of(block)
    normal, right, _ = rays.totals()
    held = np.isfinite(block.point_sd)
    known = np.where(held, block.point_positions - rays.axes.origin, 0.0)
    right = np.where(held, known, right - np.einsum("nij,nj->ni", normal, known))
    normal[held[:, :, np.newaxis] | held[:, np.newaxis, :]] = 0.0
    normal[held[:, :, np.newaxis] & np.eye(3, dtype=bool)] = 1.0
    return rays.axes.from_local(np.linalg.solve(normal, right[:, :, np.newaxis])[:, :, 0])
