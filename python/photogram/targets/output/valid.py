"""The part of a picture in which a camera is known well enough, as one outline."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.targets.maps import UncertaintyMap

__all__ = ["valid_region"]

DIRECTIONS, STEPS = 90, 400
"""In which an outline is looked for about the best known pixel, and steps along each."""


def valid_region(found: UncertaintyMap, largest: float) -> Floats:
    """Return (n, 2) the closed outline of the pixels to which the worst sd stays below a bound.

    From the best known pixel of the map outwards in 90 directions, each as far as the standard deviation,
    linear between pixels of the map, is not above the bound.

    Raises
    ------
    InputError
        No pixel of the map is as good.
    """
    sd = np.where(np.isfinite(found.sd), found.sd, np.inf)
    row, column = np.unravel_index(np.argmin(sd), sd.shape)
    if not sd[row, column] <= largest:
        raise InputError(
            f"the camera {found.camera} is nowhere known to {largest:g} px: its best pixel has"
            f" {sd[row, column]:.3g} px"
        )
    middle = np.array([found.columns[column], found.rows[row]])
    angles = np.linspace(0, 2 * np.pi, DIRECTIONS + 1)
    # Down to the farthest corner, and cut where the picture ends.
    lengths = np.linspace(0, float(np.hypot(*found.size)), STEPS)
    places = (
        middle + lengths[:, np.newaxis] * np.stack([np.cos(angles), np.sin(angles)], axis=1)[:, np.newaxis]
    )
    last = np.array(found.size) - 1.0
    inside = ((places >= 0) & (places <= last)).all(axis=2)
    good = inside & (_between(found, sd, np.clip(places, 0, last)) <= largest)
    steps = np.where(good.all(axis=1), STEPS, np.argmin(good, axis=1)) - 1
    return np.asarray(places[np.arange(len(angles)), steps])


def _between(found: UncertaintyMap, sd: Floats, places: Floats) -> Floats:
    """Return values of a map at places (..., 2), linear between its pixels in both directions."""
    parts = []
    for axis, nodes in enumerate((found.columns, found.rows)):
        own = np.clip(np.searchsorted(nodes, places[..., axis], side="right") - 1, 0, len(nodes) - 2)
        parts.append((own, (places[..., axis] - nodes[own]) / (nodes[own + 1] - nodes[own])))
    (i, x), (j, y) = parts
    with np.errstate(invalid="ignore"):
        upper = sd[j, i] * (1 - x) + sd[j, i + 1] * x
        lower = sd[j + 1, i] * (1 - x) + sd[j + 1, i + 1] * x
        whole: Floats = upper * (1 - y) + lower * y
    return np.where(np.isnan(whole), np.inf, whole)
