"""Rays that meet a spheroid."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats

__all__ = ["nearest_intersection"]


def nearest_intersection(origins: Floats, rays: Floats, a: float, b: float) -> Floats:
    """Return where lines meet a spheroid about the origin, nearest to where they begin, before or behind.

    Parameters
    ----------
    origins, rays
        (n, 3) where lines begin, and their directions.
    a, b
        Semi-axes along X and Y, and along Z.

    Returns
    -------
    (n, 3); of a line that misses the spheroid its point where the spheroid, enlarged, would touch it.
    """
    stretch = np.array([1.0, 1.0, a / b])
    from_centre, along = origins * stretch, rays * stretch
    square = np.einsum("ni,ni->n", along, along)
    middle = -np.einsum("ni,ni->n", from_centre, along) / square
    # |o + (m + s) d|^2 = a^2 about the middle of the chord, where o + m d is square to d.
    foot = from_centre + middle[:, np.newaxis] * along
    half = np.sqrt(np.maximum(a * a - np.einsum("ni,ni->n", foot, foot), 0.0) / square)
    ends = np.stack([middle - half, middle + half])
    nearest = np.where(np.abs(ends[0]) <= np.abs(ends[1]), ends[0], ends[1])
    return np.asarray(origins + nearest[:, np.newaxis] * rays)
