"""The points and photos that an adjustment determines worst, with their condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from photogram.network.geometry import geographic_to_geocentric, lengths_of_units

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.results.result import Result

__all__ = ["WeakestPhoto", "WeakestPoint", "weakest_lines", "weakest_photos", "weakest_points"]

WORST = 10
NEAR = 1e-3
"""Distance from a station, in the median of such distances, below which a point stands first."""


@dataclass(frozen=True)
class WeakestPoint:
    """A point among those that are determined worst.

    Attributes
    ----------
    point
        Its name.
    ratio
        The largest of its standard deviations over the smallest, in any directions: the root of the ratio of
        the eigenvalues of its covariance matrix. Rays that meet at right angles give about 1, nearly
        parallel ones 10,000 and more. 1 where a component is held.
    distance
        From the nearest station that sees it, in the median of these distances.
    rays
        Number of its images.
    """

    point: str
    ratio: float
    distance: float
    rays: int


@dataclass(frozen=True)
class WeakestPhoto:
    """A photo among those that are determined worst.

    Attributes
    ----------
    photo
        Its name.
    condition
        Largest over smallest eigenvalue of the covariance matrix of position and attitude, scaled to a
        diagonal of ones. Points on a line leave a photo free to turn about it: then it has no bound.
    images
        Number of its images.
    """

    photo: str
    condition: float
    images: int


@np.errstate(all="ignore")
def weakest_points(result: Result, count: int = WORST) -> list[WeakestPoint]:
    """Return the points of the largest ratios, and those nearest to a station, the worst first.

    Parameters
    ----------
    result
        With cofactors; without them there are none.
    count
        How many, at the most.
    """
    block = result.block
    cofactors = np.array(result.point_cofactors)
    if block.spheroid is not None:
        units = lengths_of_units(result.point_positions, block.spheroid)
        cofactors *= units[:, :, np.newaxis] * units[:, np.newaxis, :]
    known = np.isfinite(cofactors).all(axis=(1, 2)) & (result.point_rays > 0)
    ratio = np.full(len(known), np.nan)
    free = known & np.isinf(block.point_sd).all(axis=1)
    ratio[known] = 1.0
    ratio[free] = np.sqrt(_condition(cofactors[free]))
    distance = _distances(result)
    order = np.lexsort((distance, -ratio))
    near = np.flatnonzero(distance < NEAR)
    chosen = [*near[np.argsort(distance[near])], *order[np.isfinite(ratio[order]) | np.isinf(ratio[order])]]
    return [
        WeakestPoint(
            block.point_ids[row], float(ratio[row]), float(distance[row]), int(result.point_rays[row])
        )
        for row in list(dict.fromkeys(int(each) for each in chosen))[:count]
    ]


@np.errstate(all="ignore")
def weakest_photos(result: Result, count: int = WORST) -> list[WeakestPhoto]:
    """Return the photos of the largest conditions, the worst first.

    Fixed unknowns of a photo do not count; those of which all are fixed are left out.
    """
    cofactors = result.photo_cofactors[:, :6, :6]
    images = np.bincount(result.block.image_photos[result.used_images], minlength=len(result.block.photo_ids))
    variances = np.diagonal(cofactors, axis1=1, axis2=2)
    known = (images > 0) & np.isfinite(cofactors).all(axis=(1, 2)) & (variances > 0).any(axis=1)
    rows, sd = np.flatnonzero(known), np.sqrt(np.where(variances > 0, variances, 1.0))[known]
    scaled = cofactors[known] / (sd[:, :, np.newaxis] * sd[:, np.newaxis, :])
    # The eigenvalue 1 of a fixed unknown lies between the others, whose mean is 1.
    scaled[:, range(6), range(6)] = 1.0
    condition = _condition(scaled)
    return [
        WeakestPhoto(result.block.photo_ids[rows[each]], float(condition[each]), int(images[rows[each]]))
        for each in np.argsort(-condition, kind="stable")[:count].tolist()
    ]


def weakest_lines(result: Result) -> list[str]:
    """Return the lines of a report on the weakest points and photos; none without cofactors."""
    points, photos = weakest_points(result), weakest_photos(result)
    lines = []
    if points:
        lines += [
            "largest standard deviation over the smallest (nearly parallel rays: above 10,000), and distance",
            "from the nearest station in the median of such distances (at its own place: below 0.001)",
            f"{'point':<16}{'ratio':>12}{'distance':>12}{'rays':>6}",
        ]
        lines += [
            f"{each.point:<16}{each.ratio:>12.4g}{each.distance:>12.4g}{each.rays:>6}" for each in points
        ]
    if photos:
        lines += [
            *([""] if lines else []),
            "condition of the covariance matrix of position and attitude, scaled to a diagonal of ones",
            f"{'photo':<16}{'condition':>12}{'images':>8}",
        ]
        lines += [f"{each.photo:<16}{each.condition:>12.4g}{each.images:>8}" for each in photos]
    return lines


def _condition(matrices: Floats) -> Floats:
    """Return largest over smallest eigenvalue of (n, k, k) matrices; infinite where rounding has taken it."""
    values = np.linalg.eigvalsh(matrices)
    smallest, largest = values[:, 0], values[:, -1]
    found: Floats = np.where(smallest > np.finfo(float).eps * largest, largest / smallest, np.inf)
    return found


def _distances(result: Result) -> Floats:
    """Return the distances of all points from the nearest station that sees them, in their median."""
    block = result.block
    points, photos = np.array(result.point_positions), np.array(result.photo_positions)
    if block.spheroid is not None:
        points, photos = (geographic_to_geocentric(each, block.spheroid) for each in (points, photos))
    used = result.used_images
    of_images = points[block.image_points[used]] - photos[block.image_photos[used]]
    nearest = np.full(len(points), np.inf)
    np.minimum.at(nearest, block.image_points[used], np.linalg.norm(of_images, axis=1))
    seen = np.isfinite(nearest)
    found: Floats = np.where(seen, nearest / np.median(nearest[seen]) if seen.any() else np.nan, np.nan)
    return found
