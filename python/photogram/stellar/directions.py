"""Unknown directions of a plate, and mean error ellipses on the sphere (section 5.7 of the specification)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.stellar import Result


@dataclass(frozen=True)
class Ellipse:
    """Mean error ellipse on the sphere, radians."""

    major: float
    minor: float
    direction: float  # of the major axis, from increasing right ascension towards increasing declination


def ellipse(covariance: Floats, declination: float) -> Ellipse:
    """Return the mean error ellipse from a covariance of right ascension, declination."""
    turned = np.diag([math.cos(declination), 1.0])
    values, vectors = np.linalg.eigh(turned @ covariance @ turned)
    minor, major = (math.sqrt(max(float(value), 0.0)) for value in values)
    return Ellipse(major, minor, math.atan2(vectors[1, 1], vectors[0, 1]) % math.pi)


@dataclass(frozen=True, eq=False)
class Direction:
    """Estimated unknown direction; all angles are in radians."""

    star: str
    place: tuple[float, float]  # Right ascension and declination
    correction: tuple[float, float]  # Correction of the direction of its first image
    azimuth: float  # Observed (refracted) at its first image, from south, positive west
    elevation: float
    mean_errors: tuple[float, float]  # Mean errors of right ascension times cos(declination), and declination
    # m_i: mean error of unit weight from the agreement of its own images; for a single image, the one of the
    # adjustment
    image_mean_error: float
    orientation: Ellipse  # From the orientation only, with error-free images
    total: Ellipse  # With its images at the mean error of unit weight of the adjustment
    published: Ellipse  # With its images at m_i, as in the report


def directions(result: Result) -> list[Direction]:
    """Return the unknown directions of a plate with their error ellipses."""
    problem, solved, unit = result.problem, result.solved, result.mean_error
    unknown = np.flatnonzero(~problem.known)
    if not unknown.size:
        return []
    of_images = problem.core(solved.parameters, solved.places, ~solved.free).directions()
    order = np.argsort(problem.image_stars, kind="stable")
    firsts = np.searchsorted(problem.image_stars[order], unknown)
    counts = np.bincount(problem.image_stars)[unknown]
    found = []
    for star, begin, count in zip(unknown.tolist(), firsts, counts, strict=True):
        images = order[begin : begin + count]
        (right, declination), first = solved.places[star].tolist(), of_images[images[0]]
        residuals, weights = solved.residuals[images], problem.image_weights[images]
        square = float(np.einsum("mi,mij,mj->", residuals, weights, residuals))
        image_error = math.sqrt(square / (2 * len(images) - 2)) if len(images) > 1 else unit
        inverse, total = solved.star_inverse[star], result.star_covariances[star]
        orientation = unit**2 * (solved.star_cofactors[star] - inverse)
        time = problem.image_times[images[:1]]
        ((xi, eta),) = problem.site.standard_coordinates(solved.places[[star]], time, solved.parameters[22:])
        found.append(
            Direction(
                star=problem.star_ids[star],
                place=(right, declination),
                correction=(math.remainder(right - first[0], math.tau), float(declination - first[1])),
                azimuth=math.atan2(-eta, -xi) % math.tau,
                elevation=math.atan2(1.0, math.hypot(xi, eta)),
                mean_errors=(math.sqrt(total[0, 0]) * math.cos(declination), math.sqrt(total[1, 1])),
                image_mean_error=image_error,
                orientation=ellipse(orientation, declination),
                total=ellipse(total, declination),
                published=ellipse(orientation + image_error**2 * inverse, declination),
            )
        )
    return found
