"""Unknown directions of a plate, and mean error ellipses on the sphere (section 5.7 of the specification)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.show.sketch.marks import ellipse_axes

if TYPE_CHECKING:
    from photogram.stellar import Result


def mean_error_ellipses(covariances: Floats, declinations: Floats) -> Floats:
    """Return (n, 3) major and minor semi-axes and directions of ellipses on the sphere, radians.

    Covariances (n, 2, 2) are of right ascension and declination. Directions of the major axes count from
    increasing right ascension towards increasing declination.
    """
    scale = np.column_stack([np.cos(declinations), np.ones(len(declinations))])
    semi_axes, angles = ellipse_axes(covariances * scale[:, :, None] * scale[:, None])
    return np.column_stack([semi_axes, np.radians(angles) % np.pi])


@dataclass(frozen=True, eq=False)
class Directions:
    """Estimated directions of k unknown stars, in radians."""

    stars: Indices  # (k,) rows among the stars
    places: Floats  # (k, 2) right ascension and declination
    corrections: Floats  # (k, 2) of the direction of the first image
    # (k, 2) observed (refracted) azimuth from south, positive west, and elevation at the first image
    horizontal: Floats
    mean_errors: Floats  # (k, 2) of right ascension times cos(declination), and of declination
    # (k,) m_i: mean error of unit weight from the agreement of the images of a star; for a single image, the
    # one of the adjustment
    image_mean_errors: Floats
    # (k, 3) ellipses: from the orientation only; with images at the mean error of unit weight of the
    # adjustment; with images at m_i, as in the report
    orientation: Floats
    total: Floats
    published: Floats


def directions(result: Result) -> Directions:
    """Return the unknown directions of a plate with their error ellipses."""
    problem, solved, unit = result.problem, result.solved, result.mean_error
    stars = np.flatnonzero(~problem.known)
    seen, first = np.unique(problem.image_stars, return_index=True)
    first = first[np.searchsorted(seen, stars)]
    squares = np.einsum("mi,mij,mj->m", solved.residuals, problem.image_weights, solved.residuals)
    sums, counts = (np.bincount(problem.image_stars, each)[stars] for each in (squares, None))
    image_errors = np.where(counts > 1, np.sqrt(sums / np.maximum(2 * counts - 2, 1)), unit)
    places, inverse, total = solved.places[stars], solved.star_inverse[stars], result.star_covariances[stars]
    orientation = unit**2 * (solved.star_cofactors[stars] - inverse)
    published = orientation + image_errors[:, None, None] ** 2 * inverse
    core = problem.core(solved.parameters, solved.places, ~solved.free)
    corrections = places - (core.directions()[first] if stars.size else places)
    corrections[:, 0] = np.remainder(corrections[:, 0] + np.pi, 2 * np.pi) - np.pi
    xi, eta = problem.site.standard_coordinates(places, problem.image_times[first], solved.parameters[22:]).T
    cosines = np.column_stack([np.cos(places[:, 1]), np.ones(len(stars))])
    return Directions(
        stars=stars,
        places=places,
        corrections=corrections,
        horizontal=np.column_stack([np.arctan2(-eta, -xi) % (2 * np.pi), np.arctan2(1.0, np.hypot(xi, eta))]),
        mean_errors=np.sqrt(np.diagonal(total, axis1=1, axis2=2)) * cosines,
        image_mean_errors=image_errors,
        orientation=mean_error_ellipses(orientation, places[:, 1]),
        total=mean_error_ellipses(total, places[:, 1]),
        published=mean_error_ellipses(published, places[:, 1]),
    )
