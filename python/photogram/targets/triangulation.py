"""Points from the images of several cameras in one housing, with the errors of their calibration.

The point X of axes of camera 0 has the least squares of the residuals of its images q. With J and C the
partials of the images by X and by the common unknowns b, it depends on both by

    dX = (J'J)^-1 J' dq + E db,      E = -(J'J)^-1 J' C.

Errors of pixels are those of each point alone, sigma^2 (J'J)^-1; those of the calibration, E Q E', all points
have in common: no mean of many points is free of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.annotations import check_arguments
from photogram.arguments.arrays import argument_error, length, shaped
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.targets.calibration_result import Calibrated
from photogram.targets.housing import Housing, camera_number, housed_with, housing_of, size_of, transformed
from photogram.targets.maps import image_grid
from photogram.targets.projection import housing_rows
from photogram.targets.vision import imaged, motion_partials, rays
from photogram.words import phrase

STEPS = 30
TOLERANCE = 1e-12  # in distances of the point


@dataclass(frozen=True, eq=False)
class Triangulated:
    """Points with the two parts of their covariance.

    Attributes
    ----------
    points
        (n, 3) in the axes of camera 0, in the unit of the board; NaN where rays do not meet in front.
    residuals
        (n, k, 2) measured less computed images, pixels.
    by_pixels
        (n, 3, 3) covariances that errors of the pixels cause.
    by_calibration
        (3 n, 3 n) covariance of all points together that errors of the calibration cause.
    """

    points: Floats
    residuals: Floats
    by_pixels: Floats
    by_calibration: Floats

    @property
    def distances(self) -> Floats:
        """(n,) from the centre of camera 0."""
        return np.asarray(np.linalg.norm(self.points, axis=1))

    @property
    def sd_of_distances(self) -> Floats:
        """(n, 2) along the rays of camera 0: by pixels, and by the calibration."""
        count = len(self.points)
        along = self.points / self.distances[:, np.newaxis]
        own = self.by_calibration.reshape(count, 3, count, 3)[np.arange(count), :, np.arange(count)]
        variances = [np.einsum("ni,nij,nj->n", along, each, along) for each in (self.by_pixels, own)]
        return np.asarray(np.sqrt(np.stack(variances, axis=1)))

    @property
    def covariance(self) -> Floats:
        """(3 n, 3 n) of all points together, both parts."""
        found, count = self.by_calibration.copy(), len(self.points)
        blocks = found.reshape(count, 3, count, 3)
        blocks[np.arange(count), :, np.arange(count)] += self.by_pixels
        return found


def triangulated(
    housing: Housing, cameras: Sequence[int], pixels: Floats, pixel_sd: float, still: Floats | None = None
) -> Triangulated:
    """Return points by their (n, k, 2) images in k cameras of a housing, 2 or more, by their numbers.

    `pixel_sd` is that of an image coordinate. Where points are fixed to the housing, `still` is (6, c + 6)
    the motion of the axes of camera 0 that goes with the unknowns
    (:func:`~photogram.targets.projection.housing_rows`); None: they are in the axes of camera 0 themselves.
    """
    points = _settled(housing, cameras, pixels, _met(housing, cameras, pixels))
    residuals, by_point, by_common = _rows(housing, cameras, pixels, points)
    with np.errstate(invalid="ignore"):
        inverse = _inverted(by_point.transpose(0, 2, 1) @ by_point)
        effects = -inverse @ by_point.transpose(0, 2, 1) @ by_common
    if still is not None:
        effects = effects - motion_partials(points) @ still[:, : housing.common]
    effects = effects.reshape(-1, housing.common)
    common = housing.variance * housing.cofactors[: housing.common, : housing.common]
    return Triangulated(
        points, residuals.reshape(pixels.shape), pixel_sd**2 * inverse, effects @ common @ effects.T
    )


def _met(housing: Housing, cameras: Sequence[int], pixels: Floats) -> Floats:
    """Return (n, 3) the points that are nearest to all rays: sum (I - r r') (X - O) = 0."""
    normal, right = np.zeros((len(pixels), 3, 3)), np.zeros((len(pixels), 3))
    for number, camera in enumerate(cameras):
        turn, shift = housing.sensors[camera, :3, :3], housing.sensors[camera, :3, 3]
        looking = rays(housing.cameras[camera], pixels[:, number]) @ turn
        across = np.eye(3) - looking[:, :, np.newaxis] * looking[:, np.newaxis]
        normal += across
        right -= across @ (turn.T @ shift)
    return np.asarray((_inverted(normal) @ right[:, :, np.newaxis])[:, :, 0])


def _settled(housing: Housing, cameras: Sequence[int], pixels: Floats, points: Floats) -> Floats:
    """Return the points of least squares; NaN where steps do not end."""
    moved = np.full(len(points), np.inf)
    for _ in range(STEPS):
        residuals, by_point, _ = _rows(housing, cameras, pixels, points)
        transposed = by_point.transpose(0, 2, 1)
        right = transposed @ residuals[:, :, np.newaxis]
        step = (_inverted(transposed @ by_point) @ right)[:, :, 0]
        points = points + step
        with np.errstate(invalid="ignore"):
            moved = np.linalg.norm(step, axis=1) / np.linalg.norm(points, axis=1)
        if not (moved > TOLERANCE).any():
            break
    return np.asarray(np.where((moved <= 1e3 * TOLERANCE)[:, np.newaxis], points, np.nan))


def _rows(
    housing: Housing, cameras: Sequence[int], pixels: Floats, points: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return (n, 2 k) observed less computed, and partials by points (n, 2 k, 3) and unknowns (n, 2 k, c)."""
    parts = [housing.linearized(camera, points) for camera in cameras]
    xy, by_point, by_common = (np.stack(each, axis=1) for each in zip(*parts, strict=True))
    shape = len(points), 2 * len(cameras)
    return (
        (pixels - xy).reshape(shape),
        by_point.reshape(*shape, 3),
        by_common.reshape(*shape, housing.common),
    )


def _inverted(matrices: Floats) -> Floats:
    """Return inverses; NaN of what has none."""
    rows = np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2)))
    rows = rows[np.linalg.cond(matrices[rows]) < 1 / np.finfo(float).eps]
    found = np.full_like(matrices, np.nan)
    found[rows] = np.linalg.inv(matrices[rows])
    return found


Axes = Literal["axes", "corners"]


def triangulate(
    result: Calibrated, cameras: Sequence[int | str], pixels: ArrayLike, pixel_sd: float, datum: Axes = "axes"
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
        raise argument_error("pixel_sd", "positive", value=pixel_sd)
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
        raise argument_error("depth", "positive", value=depth)
    housing, numbers = _of_rig(result, cameras)
    sizes = [size_of(result, camera_number(result, each)) for each in cameras]
    pixels = image_grid(sizes[0], grid)[2]
    looking = rays(housing.cameras[numbers[0]], pixels)
    ahead = looking[:, 2] > 0
    points = looking[ahead] * (depth / looking[ahead, 2:])
    to_first = np.linalg.inv(housing.sensors[numbers[0]])
    images = np.stack(
        [
            imaged(housing.cameras[each], transformed(housing.sensors[each] @ to_first, points)).xy
            for each in numbers
        ],
        axis=1,
    )
    with np.errstate(invalid="ignore"):
        seen = ((images >= 0) & (images <= np.array(sizes) - 1)).all(axis=(1, 2))
    return pixels[ahead][seen], triangulated(housing, numbers, images[seen], pixel_sd)


def _of_rig(result: Calibrated, cameras: Sequence[int | str]) -> tuple[Housing, list[int]]:
    numbers = [camera_number(result, each) for each in cameras]
    if len(numbers) < 2 or len(set(numbers)) < len(numbers):
        raise InputError(phrase("targets.two-cameras-once"))
    housed = housed_with(result, numbers[0])
    if not set(numbers) <= set(housed):
        raise InputError(phrase("targets.not-tied"))
    return housing_of(result, numbers[0])[0], [housed.index(each) for each in numbers]


check_arguments(globals(), ["distance_uncertainty", "triangulate"])
