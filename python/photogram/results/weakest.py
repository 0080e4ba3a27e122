"""The points and photos that an adjustment determines worst, with their condition."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.results.axes import Determined
from photogram.results.network import AdjustedNetwork

WORST = 10
NEAR = 1e-3  # Points closer to a station, as a part of the median distance, are listed first


@dataclass(frozen=True)
class WeakestPoint:
    """A point among those that are determined worst."""

    row: int  # Among the points of the network
    point: str  # Its name
    # The largest of its standard deviations over the smallest, in any directions: the root of the ratio
    # of the eigenvalues of its covariance matrix. Rays that meet at right angles give about 1, nearly
    # parallel ones 10,000 and more. 1 if a component is held
    ratio: float
    # From the nearest station that sees it, in the median of these distances; NaN where scanners alone
    # do
    distance: float
    rays: int  # Number of its images


@dataclass(frozen=True)
class WeakestPhoto:
    """A photo among those that are determined worst."""

    row: int  # Among the photos of the network
    photo: str  # Its name
    # Largest over smallest eigenvalue of the covariance matrix of position and attitude, scaled to a
    # diagonal of ones. Points on a line leave a photo free to turn about it: then it has no bound
    condition: float
    images: int  # Number of its images


@np.errstate(all="ignore")
def weakest_points(result: AdjustedNetwork, count: int = WORST) -> list[WeakestPoint]:
    """Return the points of the largest ratios, and those nearest to a station, the worst first.

    None without cofactors.
    """
    network = result._determined()
    cofactors = network.point_cofactors
    known = np.isfinite(cofactors).all(axis=(1, 2)) & result.used_points
    ratio = np.full(len(known), np.nan)
    free = known & np.isinf(result.point_given_sd).all(axis=1)
    ratio[known] = 1.0
    ratio[free] = np.sqrt(_condition(cofactors[free], 3))
    distance = _distances(result, network)
    order = np.lexsort((distance, -ratio))
    near = np.flatnonzero(distance < NEAR)
    worst = order[~np.isnan(ratio[order])][:count]
    chosen = [*near[np.argsort(distance[near])].tolist(), *worst.tolist()]
    return [
        WeakestPoint(
            row,
            result.given.point_ids[row],
            float(ratio[row]),
            float(distance[row]),
            int(result.point_rays[row]),
        )
        for row in list(dict.fromkeys(chosen))[:count]
    ]


@np.errstate(all="ignore")
def weakest_photos(result: AdjustedNetwork, count: int = WORST) -> list[WeakestPhoto]:
    """Return the photos of the largest conditions, the worst first.

    Fixed unknowns of a photo do not count; those of which all are fixed are left out.
    """
    network = result._determined()
    names, photos = result.given.photo_ids, result.given.image_photos
    images = np.bincount(photos[result.used_images], minlength=len(names))
    known = (images > 0) & np.isfinite(network.poses).all(axis=(1, 2)) & (network.ranks > 0)
    poses, rows = network.poses[known], np.flatnonzero(known)
    variances = np.diagonal(poses, axis1=1, axis2=2)
    sd = np.sqrt(np.where(variances > 0, variances, 1.0))
    condition = _condition(poses / (sd[:, :, np.newaxis] * sd[:, np.newaxis, :]), network.ranks[known])
    return [
        WeakestPhoto(int(rows[k]), names[rows[k]], float(condition[k]), int(images[rows[k]]))
        for k in np.argsort(-condition, kind="stable")[:count].tolist()
    ]


def _condition(matrices: Floats, ranks: Indices | int) -> Floats:
    """Return largest over smallest eigenvalue of (n, k, k) matrices; infinite where rounding has taken it.

    Of the smaller ranks only so many eigenvalues count: the others belong to what is fixed.
    """
    values = np.linalg.eigvalsh(matrices)
    largest = values[:, -1]
    smallest = np.take_along_axis(values, values.shape[1] - np.reshape(ranks, (-1, 1)), axis=1)[:, 0]
    found: Floats = np.where(smallest > np.finfo(float).eps * largest, largest / smallest, np.inf)
    return found


def _distances(result: AdjustedNetwork, network: Determined) -> Floats:
    """Return the distances of all points from the nearest station that sees them, in their median."""
    used = result.used_images
    if network.moving is not None:
        used = used & ~network.moving[result.given.image_photos]
    own = result.image_points[used]
    of_images = network.points[own] - network.stations[result.given.image_photos[used]]
    nearest = np.full(len(network.points), np.inf)
    np.minimum.at(nearest, own, np.linalg.norm(of_images, axis=1))
    seen = np.isfinite(nearest)
    found: Floats = np.where(seen, nearest / np.median(nearest[seen]) if seen.any() else np.nan, np.nan)
    return found
