"""Corners of boards: saddle points of grey values, each where its neighbours put it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats, Indices

__all__ = ["Picture", "refined", "settled"]

Picture = NDArray[np.uint8]
STEPS, STEP = 50, 1e-4
"""Iterations of a corner, and the step in pixels that ends them."""
SMALLEST, LARGEST = 2, 15
"""Half the sides of windows, pixels."""
NEIGHBOURS = 14
"""Corners that say where another one must be."""
APART = 1.0
"""Pixels from there: whatever the lens, less than a wrong corner is."""


def refined(cv2: Any, picture: Picture, xy: Floats, half: Floats) -> Floats:
    """Return the saddle points next to corners (n, 2), in windows of their half sides (n,), pixels."""
    found = xy.copy()
    end = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, STEPS, STEP)
    sides = np.clip(half, SMALLEST, LARGEST).astype(int)
    for each in np.unique(sides).tolist():
        own = sides == each
        start = xy[own].astype(np.float32).reshape(-1, 1, 2)
        moved = cv2.cornerSubPix(picture, start, (each, each), (-1, -1), end)
        found[own] = np.asarray(moved, dtype=np.float64).reshape(-1, 2)
    return found


def settled(
    cv2: Any, picture: Picture, points: Indices, xy: Floats, places: Floats, half: float
) -> tuple[Indices, Floats]:
    """Return corners that agree with their neighbours, refined, and the numbers of their points.

    Those that do not are looked for again where their neighbours put them, and left out if not there. Seven
    corners or fewer say nothing of each other, and are left out. Points and xy are (n,) numbers and (n, 2)
    first places in the picture, `places` (b, 2) points of the board; `half` is that of the window of a
    corner, over the distance between the nearest points of the board.
    """
    own = places[points]
    sides = half * _scales(own, xy)
    found = refined(cv2, picture, xy, sides)
    expected = _by_neighbours(cv2, own, found)
    away = ~(np.linalg.norm(found - expected, axis=1) < APART)
    known = away & np.isfinite(expected).all(axis=1)
    if known.any():
        found[known] = refined(cv2, picture, expected[known], sides[known])
        expected = _by_neighbours(cv2, own, found)
        away = ~(np.linalg.norm(found - expected, axis=1) < APART)
    return points[~away], found[~away]


def _scales(places: Floats, xy: Floats) -> Floats:
    """Return (n,) pixels between a point and the one nearest to it on the board."""
    apart = np.linalg.norm(places[:, np.newaxis] - places, axis=2)
    np.fill_diagonal(apart, np.inf)
    nearest = apart.argmin(axis=1)
    found: Floats = np.linalg.norm(xy - xy[nearest], axis=1)
    # Of two that are misplaced the distance says little: no window is larger than that of the middle one.
    return np.minimum(found, np.median(found))


def _by_neighbours(cv2: Any, places: Floats, xy: Floats) -> Floats:
    """Return (n, 2) where a homography of the points around each one puts it; NaN where there are too few."""
    found = np.full_like(xy, np.nan)
    if len(xy) <= NEIGHBOURS // 2:
        return found
    apart = np.linalg.norm(places[:, np.newaxis] - places, axis=2)
    order = np.argsort(apart, axis=1, kind="stable")[:, 1 : NEIGHBOURS + 1]
    for row, near in enumerate(order):
        plane, _ = cv2.findHomography(places[near], xy[near], cv2.LMEDS)
        if plane is not None:
            to = plane @ [*places[row], 1.0]
            found[row] = to[:2] / to[2]
    return found
