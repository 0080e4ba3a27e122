"""Triangulation by several cameras of one housing, with calibration errors.

The point X in axes of camera 0 minimises the sum of squares of the residuals of its image points q. With J
and C the partials of the image points by X and by the common unknowns b,

    dX = (J'J)^-1 J' dq + E db,      E = -(J'J)^-1 J' C.

Pixel errors are independent between points, sigma^2 (J'J)^-1. Calibration errors, E Q E', are common to all
points: averaging many points does not reduce them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from photogram.adjustment.adjustment import adjust
from photogram.arguments.arrays import number, one_of, shaped
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.rays import meet_rays
from photogram.targets.housing import Housing, camera_number, housed_with, housing_of, housing_rows, size_of
from photogram.targets.uncertainty import image_grid
from photogram.targets.vision import imaged, motion_partials, photo_poses, rays, transformed
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated

TOLERANCE = 1e-9  # in standard deviations of a point


@dataclass(frozen=True, eq=False)
class Triangulated:
    """Triangulated points with both parts of their covariance.

    Attributes
    ----------
    points
        (n, 3) in the axes of camera 0, in the unit of the board; NaN if rays do not intersect in front.
    residuals
        (n, k, 2) measured minus computed image points, pixels.
    by_pixels
        (n, 3, 3) covariances due to pixel errors.
    by_calibration
        (3 n, 3 n) joint covariance of all points due to calibration errors.
    """

    points: Floats
    residuals: Floats
    by_pixels: Floats
    by_calibration: Floats

    @property
    def distances(self) -> Floats:
        """(n,) distances from the centre of camera 0."""
        return np.asarray(np.linalg.norm(self.points, axis=1))

    @property
    def sd_of_distances(self) -> Floats:
        """(n, 2) sd along the rays of camera 0, from pixel and calibration errors."""
        count = len(self.points)
        along = self.points / self.distances[:, np.newaxis]
        own = self.by_calibration.reshape(count, 3, count, 3)[np.arange(count), :, np.arange(count)]
        variances = [np.einsum("ni,nij,nj->n", along, each, along) for each in (self.by_pixels, own)]
        return np.asarray(np.sqrt(np.stack(variances, axis=1)))

    @property
    def covariance(self) -> Floats:
        """(3 n, 3 n) joint covariance of all points, both parts."""
        found, count = self.by_calibration.copy(), len(self.points)
        blocks = found.reshape(count, 3, count, 3)
        blocks[np.arange(count), :, np.arange(count)] += self.by_pixels
        return found


def triangulated(
    housing: Housing, cameras: Sequence[int], pixels: Floats, pixel_sd: float, still: Floats | None = None
) -> Triangulated:
    """Return points from image points (n, k, 2) in k cameras of a housing, k >= 2.

    `pixel_sd` is the sd of an image coordinate. `still` (6, c + 6) is the motion of the axes of camera 0 with
    the unknowns (:func:`~photogram.targets.housing.housing_rows`) for points fixed to the housing. None:
    points are fixed to the axes of camera 0.
    """
    points, by_pixels = _intersected(housing, cameras, pixels, pixel_sd)
    parts = [housing.linearized(camera, points) for camera in cameras]
    xy, by_point, by_common = (np.stack(each, axis=1) for each in zip(*parts, strict=True))
    crossed = np.einsum("nkip,nkic->npc", by_point, by_common)
    effects = -by_pixels / pixel_sd**2 @ crossed
    if still is not None:
        effects = effects - motion_partials(points) @ still[:, : housing.common]
    effects = effects.reshape(-1, housing.common)
    common = housing.variance * housing.cofactors[: housing.common, : housing.common]
    return Triangulated(points, pixels - xy, by_pixels, effects @ common @ effects.T)


def _intersected(
    housing: Housing, cameras: Sequence[int], pixels: Floats, pixel_sd: float
) -> tuple[Floats, Floats]:
    """Return least-squares points (n, 3) of fixed cameras, and their covariances; NaN without a point."""
    poses = housing.sensors[[*cameras]]
    centres, attitudes = photo_poses(poses)
    towards = [
        rays(housing.cameras[each], pixels[:, row]) @ pose[:3, :3]
        for row, (each, pose) in enumerate(zip(cameras, poses, strict=True))
    ]
    looking = np.nan_to_num(np.stack(towards, axis=1))  # no direction without a pixel: not in front
    points, photos = np.indices(pixels.shape[:2]).reshape(2, -1)
    met = meet_rays(points, len(pixels), centres[photos], looking.reshape(-1, 3))
    in_front = (np.einsum("nki,nki->nk", looking, met[:, np.newaxis] - centres) > 0).all(axis=1)
    if not in_front.any():
        return np.full_like(met, np.nan), np.full((len(met), 3, 3), np.nan)
    used = in_front[points]
    block = Block(
        photo_positions=centres,
        photo_attitudes=attitudes.values("omega_phi_kappa"),
        photo_position_sd=0.0,
        photo_attitude_sd=0.0,
        cameras=[housing.cameras[each].replace(sd=0.0, covariance=None, knot_sd=None) for each in cameras],
        photo_cameras=np.arange(len(cameras)),
        point_positions=met,
        point_sd=np.inf,
        image_photos=photos[used],
        image_points=points[used],
        image_xy=pixels[in_front].reshape(-1, 2),
        image_sd=pixel_sd,
    )
    result = adjust(block, unit_variance="unity", tolerance=TOLERANCE)
    return result.point_positions, result.point_cofactors


Axes = Literal["axes", "corners"]


def triangulate(
    result: Calibrated, cameras: Sequence[int | str], pixels: ArrayLike, pixel_sd: float, datum: Axes = "axes"
) -> Triangulated:
    """Triangulate points from image points of a rig, with both covariance parts.

    Parameters
    ----------
    result, cameras
        Adjusted calibration of a rig, and k of its cameras: numbers or names.
    pixels
        (n, k, 2) image points of n points, from 0 at the centre of the first pixel.
    pixel_sd
        Standard deviation of an image coordinate, pixels.
    datum
        `axes`: points refer to the axes of camera 0, which does not affect distances. `corners`: points refer
        to the housing, defined by the corners of all cameras.

    Raises
    ------
    InputError
        If cameras are not on one rig, are fewer than two, or repeat, or if arrays have other shapes.
    """
    housing, numbers = _of_rig(result, cameras)
    where = shaped("pixels", pixels, (None, len(numbers), 2))
    number("pixel_sd", pixel_sd, "positive")
    one_of("datum", datum, get_args(Axes))
    still = housing_rows(housing) if datum == "corners" else None
    return triangulated(housing, numbers, where, pixel_sd, still)


def distance_uncertainty(
    result: Calibrated,
    cameras: Sequence[int | str],
    depth: float,
    pixel_sd: float,
    grid: tuple[int, int] = (30, 20),
) -> tuple[Floats, Triangulated]:
    """Compute distance uncertainties over the image of the first camera at a depth.

    Parameters
    ----------
    result, cameras, pixel_sd
        As in :func:`triangulate`.
    depth
        Depth of the points along the axis of the first camera, in the unit of the board.
    grid
        Number of pixels across and down.

    Returns
    -------
    (n, 2) pixels of the first camera whose points are visible in all others, and the points.

    Raises
    ------
    InputError
        As in :func:`triangulate`, or if an image size is unknown, or if the depth is not positive.
    """
    number("depth", depth, "positive")
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
        raise InputError(phrase("targets.two-cameras-once", names=[*map(str, cameras)]))
    housed = housed_with(result, numbers[0])
    if not set(numbers) <= set(housed):
        raise InputError(phrase("targets.not-tied"))
    return housing_of(result, numbers[0])[0], [housed.index(each) for each in numbers]
