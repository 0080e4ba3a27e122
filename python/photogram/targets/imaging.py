"""Images of points in the axes of vision, x right, y down, z forward, with their partials."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.targets.vision import FLIP, cross_matrices

__all__ = ["TURNED", "Imaged", "imaged", "motion_partials", "rays", "unknown_of", "values_of"]

TURNED: Floats = np.diag(FLIP)
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
        (n, 2, p) by the parameters of the camera that are unknown, in their order, then by its unknown knots:
        K.
    """

    xy: Floats
    by_point: Floats
    by_parameters: Floats


def imaged(camera: Camera, points: Floats) -> Imaged:
    """Return the images of (n, 3) points, or directions, in the axes of a camera, with their partials."""
    xy, by_u, by_parameters = camera.partials(points * TURNED)
    return Imaged(xy, by_u * TURNED, by_parameters[:, :, unknown_of(camera)])


def unknown_of(camera: Camera) -> Bools:
    """Return which parameters of a camera are unknown, and behind them which of its knots."""
    unknown = camera.deviations > 0
    if camera.knots is None:
        return unknown
    knots = np.zeros(camera.knots.size, dtype=bool)
    if camera.knot_sd is not None:
        knots = camera.knot_sd.any(axis=2).repeat(2)
    return np.append(unknown, knots)


def values_of(camera: Camera) -> Floats:
    """Return the parameters of a camera, and behind them its knots."""
    return camera.values if camera.knots is None else np.append(camera.values, camera.knots)


def rays(camera: Camera, pixels: Floats) -> Floats:
    """Return (n, 3) unit vectors, in the axes of a camera, to where (n, 2) pixels look; NaN without."""
    return np.asarray(camera.rays(pixels) * TURNED)


def motion_partials(points: Floats, finite: bool = True) -> Floats:
    """Return (n, 3, 6) G = (I, -[p]x): what a motion (dt, w) of all points does to each of (n, 3).

    Points at infinity, which are directions, do not feel the translation.
    """
    by_translation = np.broadcast_to(np.eye(3) if finite else np.zeros((3, 3)), (len(points), 3, 3))
    return np.concatenate([by_translation, -cross_matrices(points)], axis=2)
