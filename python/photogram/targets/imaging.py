"""Images of points in the axes of vision, x right, y down, z forward, with their partials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.network.cameras import Camera

__all__ = ["Imaged", "cross_matrices", "imaged", "motion_partials", "rays"]

TURNED = np.array([1.0, -1.0, -1.0])
"""From axes of vision to those of a photo, x right, y up, z back, and the other way."""


@dataclass(frozen=True, eq=False)
class Imaged:
    """Images of n points with their partials; NaN where a point has none.

    Attributes
    ----------
    xy
        (n, 2) image coordinates.
    by_point
        (n, 2, 3) by the point: Pi.
    by_parameters
        (n, 2, p) by the parameters of the camera that are unknown, in their order: K.
    """

    xy: Floats
    by_point: Floats
    by_parameters: Floats


def imaged(camera: Camera, points: Floats) -> Imaged:
    """Return the images of (n, 3) points, or directions, in the axes of a camera, with their partials."""
    xy, by_u, by_parameters = _photocore.camera_partials(camera.model, camera.values, points * TURNED)
    unknown = camera.deviations > 0
    return Imaged(xy, by_u * TURNED, by_parameters[:, :, unknown])


def rays(camera: Camera, pixels: Floats) -> Floats:
    """Return (n, 3) unit vectors, in the axes of a camera, to where (n, 2) pixels look; NaN without."""
    return np.asarray(camera.rays(pixels) * TURNED)


def cross_matrices(vectors: Floats) -> Floats:
    """Return (..., 3, 3) matrices [v]x of (..., 3) vectors: [v]x a = v x a."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    none = np.zeros_like(x)
    rows = [[none, -z, y], [z, none, -x], [-y, x, none]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def motion_partials(points: Floats, finite: bool = True) -> Floats:
    """Return (n, 3, 6) G = (I, -[p]x): what a motion (dt, w) of all points does to each of (n, 3).

    Points at infinity, which are directions, do not feel the translation.
    """
    by_translation = np.broadcast_to(np.eye(3) if finite else np.zeros((3, 3)), (len(points), 3, 3))
    return np.concatenate([by_translation, -cross_matrices(points)], axis=2)
