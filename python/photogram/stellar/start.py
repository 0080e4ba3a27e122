"""First attitudes of exposures whose stars are known: the rotation between two sets of directions."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.stellar.sky_cameras import SkyCamera

__all__ = ["local_directions", "sky_share", "turned_to"]

_GRID = (24, 16)
"""Places of the frame that are looked through."""
_LEAST = 0.02


def local_directions(standard: Floats) -> Floats:
    """Return unit directions (n, 3) north, east, zenith of standard coordinates (n, 2)."""
    every = np.column_stack([standard, np.ones(len(standard))])
    return np.asarray(every / np.linalg.norm(every, axis=1, keepdims=True), float)


def turned_to(rays: Floats, directions: Floats) -> Floats:
    """Return alpha, omega, kappa of the camera that sees directions along rays, by least squares.

    Parameters
    ----------
    rays
        (n, 3) unit directions in the camera: x right, y down, z along the axis; what is not finite does not
        count.
    directions
        (n, 3) the same north, east, zenith.

    Notes
    -----
    The matrix that maximizes the sum of ray' M direction is U diag(1, 1, d) V' of the singular value
    decomposition of the sum of ray direction' (S. Umeyama, IEEE PAMI 13, 1991), with d = -1 or 1 so that det
    M = -1: the local triad is left-handed.
    """
    finite = np.isfinite(rays).all(axis=1) & np.isfinite(directions).all(axis=1)
    left, _, right = np.linalg.svd(rays[finite].T @ directions[finite])
    sign = -float(np.linalg.det(left) * np.linalg.det(right))
    matrix = left @ np.diag([1.0, 1.0, sign]) @ right
    return _photocore.pointing_of_matrix(np.ascontiguousarray(matrix))


def sky_share(camera: SkyCamera, attitude: Floats, frame: tuple[float, float]) -> float:
    """Return what of a frame (width, height) shows the sky: not the ground, nor what no ray reaches."""
    x, y = ((np.arange(count) + 0.5) / count * size for count, size in zip(_GRID, frame, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    zenith = camera.rays(grid) @ _photocore.pointing_matrix(np.asarray(attitude, float))[:, 2]
    with np.errstate(invalid="ignore"):
        return max(float(np.mean(zenith > 0)), _LEAST)
