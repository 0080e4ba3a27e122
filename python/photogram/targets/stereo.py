"""Triangulation with an adjusted calibration, and how far it can be trusted over the picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.annotations import check_arguments
from photogram.arguments.arrays import length, shaped
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.targets.calibration_result import Calibrated
from photogram.targets.datums import housing_rows
from photogram.targets.housing import Housing, transformed
from photogram.targets.housings import camera_number, housed_with, housing_of, size_of
from photogram.targets.imaging import imaged, rays
from photogram.targets.maps import image_grid
from photogram.targets.triangulation import Triangulated, triangulated

__all__ = ["distance_uncertainty", "triangulate"]

Axes = Literal["axes", "corners"]


def triangulate(
    result: Calibrated,
    cameras: Sequence[int | str],
    pixels: ArrayLike,
    pixel_sd: float,
    datum: Axes = "axes",
) -> Triangulated:
    """Return points by their images in cameras of a rig, with both parts of their covariance.

    Parameters
    ----------
    result, cameras
        The adjusted calibration of a rig, and k of its cameras: numbers or names.
    pixels
        (n, k, 2) images of n points, from 0 at the centre of the first pixel.
    pixel_sd
        Standard deviation of an image coordinate, pixels.
    datum
        `axes`: points are in the axes of camera 0 of the rig, which distances do not depend on. `corners`:
        they are fixed to the housing, as the corners of all cameras hold it.

    Raises
    ------
    InputError
        Cameras that are not on a rig, fewer than two, one twice; other shapes.
    """
    housing, numbers = _of_rig(result, cameras)
    where = shaped("pixels", pixels, (length("pixels", pixels), len(numbers), 2))
    if not 0 < pixel_sd < np.inf:
        raise InputError(f"the standard deviation of pixels is a positive number, not {pixel_sd:g}")
    still = housing_rows(housing) if datum == "corners" else None
    return triangulated(housing, numbers, where, pixel_sd, still)


def distance_uncertainty(
    result: Calibrated,
    cameras: Sequence[int | str],
    depth: float,
    pixel_sd: float,
    grid: tuple[int, int] = (30, 20),
) -> tuple[Floats, Triangulated]:
    """Return how uncertain distances are over the picture of the first camera, at a depth along its axis.

    Parameters
    ----------
    result, cameras, pixel_sd
        As of :func:`triangulate`.
    depth
        Of the points along the axis of the first camera, in the unit of the board.
    grid
        Pixels across and down.

    Returns
    -------
    (n, 2) pixels of the first camera that all others see, too, and the points.

    Raises
    ------
    InputError
        As of :func:`triangulate`; pictures whose size nobody knows, a depth that is not positive.
    """
    if not 0 < depth < np.inf:
        raise InputError(f"a depth is a positive number, not {depth:g}")
    housing, numbers = _of_rig(result, cameras)
    sizes = [size_of(result, camera_number(result, each)) for each in cameras]
    pixels = image_grid(sizes[0], grid)[2]
    looking = rays(housing.cameras[numbers[0]], pixels)
    ahead = looking[:, 2] > 0
    points = looking[ahead] * (depth / looking[ahead, 2:])
    images = _images(housing, numbers, points)
    with np.errstate(invalid="ignore"):
        seen = ((images >= 0) & (images <= np.array(sizes) - 1)).all(axis=(1, 2))
    return pixels[ahead][seen], triangulated(housing, numbers, images[seen], pixel_sd)


def _images(housing: Housing, cameras: Sequence[int], points: Floats) -> Floats:
    """Return (n, k, 2) images of points in the axes of the first of k cameras."""
    to_first = np.linalg.inv(housing.sensors[cameras[0]])
    found = [
        imaged(housing.cameras[each], transformed(housing.sensors[each] @ to_first, points)).xy
        for each in cameras[1:]
    ]
    return np.stack([imaged(housing.cameras[cameras[0]], points).xy, *found], axis=1)


def _of_rig(result: Calibrated, cameras: Sequence[int | str]) -> tuple[Housing, list[int]]:
    """Return the housing of some cameras, and their numbers in it."""
    numbers = [camera_number(result, each) for each in cameras]
    if len(numbers) < 2 or len(set(numbers)) < len(numbers):
        raise InputError("points are triangulated by two cameras or more, each of them once")
    housed = housed_with(result, numbers[0])
    if not set(numbers) <= set(housed):
        raise InputError("points are triangulated by cameras that are tied to each other: these are not")
    return housing_of(result, numbers[0])[0], [housed.index(each) for each in numbers]


check_arguments(globals(), ["distance_uncertainty", "triangulate"])
