"""How far off the image of a point may be that stays fixed to the housing of a camera.

With K and Pi the partials of the image by the camera's parameters k and by the point p = d r(q), and
G = (I, -[p]x):  dq = K dk + Pi G tau,  tau = T db of the datum,  Q_q = J Q J'.
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.network.cameras import Camera
from photogram.targets.housing import Housing
from photogram.targets.imaging import imaged, motion_partials, rays

__all__ = [
    "common_partials",
    "image_partials",
    "of_functions",
    "point_partials",
    "projection_cofactors",
    "with_motion",
    "worst",
]

TOGETHER = 2048
"""Pixels whose partials are in memory at a time."""


def projection_cofactors(
    housing: Housing, camera: int, pixels: Floats, distance: float, rows: Floats
) -> Floats:
    """Return (n, 2, 2) cofactors of the images of points at (n, 2) pixels; NaN where a pixel sees nothing.

    Parameters
    ----------
    housing, camera
        The cameras, and the number of one.
    pixels, distance
        Where, and how far from the centre of this camera; infinite: directions.
    rows
        (6, c + 6) the datum (:func:`photogram.targets.datums.datum_rows`).
    """
    cofactors = with_motion(housing, camera, rows)
    found = np.empty((len(pixels), 2, 2))
    for start in range(0, len(pixels), TOGETHER):
        part = slice(start, start + TOGETHER)
        found[part] = of_functions(image_partials(housing.cameras[camera], pixels[part], distance), cofactors)
    return found


def with_motion(housing: Housing, camera: int, rows: Floats) -> Floats:
    """Return the (p + 6, p + 6) cofactors of a camera's parameters and of the motion of its axes."""
    own = housing.cofactors[housing.parameters(camera)]
    both = np.vstack([np.eye(len(housing.cofactors))[housing.parameters(camera)], rows])
    moved = rows @ housing.cofactors
    return np.asarray(np.vstack([own, moved]) @ both.T)


def common_partials(housing: Housing, camera: int, pixels: Floats, distance: float, rows: Floats) -> Floats:
    """Return (n, 2, c) J by the common unknowns, in a datum that says nothing of the single views."""
    partials = image_partials(housing.cameras[camera], pixels, distance)
    found = partials[:, :, -6:] @ rows[:, : housing.common]
    found[:, :, housing.parameters(camera)] += partials[:, :, :-6]
    return np.asarray(found)


def image_partials(camera: Camera, pixels: Floats, distance: float) -> Floats:
    """Return (n, 2, p + 6) J = (K, Pi G) of points at (n, 2) pixels and a distance."""
    finite = bool(np.isfinite(distance))
    return point_partials(camera, rays(camera, pixels) * (distance if finite else 1.0), finite)


def point_partials(camera: Camera, points: Floats, finite: bool) -> Floats:
    """Return (n, 2, p + 6) J = (K, Pi G) of (n, 3) points, or directions, in the axes of a camera."""
    images = imaged(camera, points)
    return np.concatenate([images.by_parameters, images.by_point @ motion_partials(points, finite)], axis=2)


def of_functions(partials: Floats, cofactors: Floats) -> Floats:
    """Return (n, 2, 2) J Q J' of (n, 2, u) partials."""
    whole = (partials.reshape(-1, partials.shape[2]) @ cofactors).reshape(partials.shape)
    return np.asarray(whole @ partials.transpose(0, 2, 1))


def worst(covariances: Floats) -> Floats:
    """Return (n,) the standard deviations in the worst direction of (n, 2, 2) covariances.

    sqrt((a + c)/2 + sqrt(((a - c)/2)^2 + b^2)) of [a b; b c].
    """
    a, b, c = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    return np.asarray(np.sqrt((a + c) / 2 + np.hypot((a - c) / 2, b)))
