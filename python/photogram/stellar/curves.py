"""Curves of distortion and refraction, residuals, unknown directions, axes (NOAA TR NOS 55)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.show.sketch.marks import ellipse_axes
from photogram.stellar.parameters import INDEX
from photogram.stellar.sky import TAU, refraction

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


@dataclass(frozen=True, eq=False)
class DistortionCurves:
    """Distortion against the distance from its centre; metres."""

    distance: Floats  # (n,) from the centre of distortion
    # (n,) radial distortion, the transformed one for the calibrated principal distance (zero at the
    # crossover), and the profile of the decentring distortion
    radial: Floats
    transformed: Floats
    decentering: Floats
    radial_error: Floats  # (n,) mean errors
    transformed_error: Floats
    decentering_error: Floats
    scale: float  # K0, the linear term of the transformation
    calibrated: float  # Calibrated principal distance c (1 - K0) and its mean error
    calibrated_error: float


def distortion_curves(result: Result) -> DistortionCurves:
    """Compute the distortion curves at the distances selected by the options.

    The mean error of the calibrated principal distance contains +c d^n for the radial coefficients. Equation
    86 prints minus, although K0 itself has plus.
    """
    options, values, covariance = result.problem.options, result.parameters, result.covariance
    count = int(np.floor(options.extent / options.interval + 1e-9)) + 1
    d = np.asarray(options.interval * np.arange(count), float)
    odd = np.column_stack([d**3, d**5, d**7])
    crossing = options.crossover ** np.array([2, 4, 6])
    radial_terms = np.array([values[name] for name in ("K1", "K2", "K3")])
    scale = -float(crossing @ radial_terms)
    across = d[:, None] * (d[:, None] ** np.array([2, 4, 6]) - crossing)
    decentering = np.column_stack([d**2, d**4])
    c = values["cx"] if options.common_scale else 0.5 * (values["cx"] + values["cy"])
    names = ["cx", "cy", "K1", "K2", "K3"]
    halves = [1 - scale, 0.0] if options.common_scale else [0.5 * (1 - scale)] * 2
    gradient = np.concatenate([halves, c * crossing])
    return DistortionCurves(
        distance=d,
        radial=odd @ radial_terms,
        transformed=across @ radial_terms,
        decentering=decentering @ np.array([values["K4"], values["K5"]]),
        radial_error=_errors(odd, covariance, names[2:]),
        transformed_error=_errors(across, covariance, names[2:]),
        decentering_error=_errors(decentering, covariance, ["K4", "K5"]),
        scale=scale,
        calibrated=c * (1 - scale),
        calibrated_error=float(_errors(gradient[None], covariance, names)[0]),
    )


def _errors(rows: Floats, covariance: Floats, names: list[str]) -> Floats:
    chosen = [INDEX[name] for name in names]
    variances = np.einsum("ni,ij,nj->n", rows, covariance[np.ix_(chosen, chosen)], rows)
    return np.asarray(np.sqrt(np.maximum(variances, 0)), float)


@dataclass(frozen=True, eq=False)
class RefractionCurves:
    """Refraction around the axis of an attitude; radians."""

    zenith_distance: Floats  # (21,) observed, from ten degrees above to ten below the axis; never negative
    # (21,) refraction with the given and the estimated coefficients, and the mean error of the latter
    given: Floats
    corrected: Floats
    error: Floats


def refraction_curves(result: Result, group: str) -> RefractionCurves:
    """Compute refraction around the axis of an orientation (`pre`, `post`, `event`)."""
    alpha, omega, _ = result.attitude(group)
    axis = float(np.arccos(np.cos(alpha) * np.cos(omega)))
    z = axis + np.radians(np.arange(-10.0, 11.0))
    z = z[(z >= 0) & (z < np.pi / 2)]
    air = result.problem.site.air
    tau = result.solved.parameters[22:]
    basis = np.column_stack([refraction(z, air, tau=row, observed=True) for row in np.eye(4)])
    return RefractionCurves(
        zenith_distance=z,
        given=refraction(z, air, tau=TAU, observed=True),
        corrected=refraction(z, air, tau=tau, observed=True),
        error=_errors(basis, result.covariance, ["tau1", "tau2", "tau3", "tau4"]),
    )


@dataclass(frozen=True, eq=False)
class Histogram:
    # (k + 1,) limits of equal classes from 3.25 standard deviations below the mean to 3.25 above
    edges: Floats
    counts: Indices  # (k,) residuals in each class, and expected numbers of the normal distribution
    expected: Floats
    mean: float  # Mean of all residuals
    sd: float


def residual_classes(result: Result) -> dict[str, Floats]:
    """Return residuals of known stars in x, y and both, metres."""
    chosen = result.solved.residuals[result.problem.known[result.problem.image_stars]]
    return {"x": chosen[:, 0], "y": chosen[:, 1], "x and y": chosen.ravel()}


def histogram(values: Floats) -> Histogram:
    """Sort residuals into the classes of the report.

    The number of classes is reduced from 31 in steps of two, until more than one residual is expected in the
    last class.
    """
    number, classes = len(values), 31

    def last(n: int) -> float:
        return 6.5 * number * float(np.exp(-0.5 * (3.25 * (1 - 1 / n)) ** 2)) / (n * math.sqrt(2 * math.pi))

    while classes > 3 and last(classes) <= 1:
        classes -= 2
    mean, sd = float(values.mean()), float(values.std())
    edges = mean + 3.25 * sd * np.linspace(-1, 1, classes + 1)
    counts = np.histogram(values, edges)[0]
    middle = 0.5 * (edges[1:] + edges[:-1])
    density = np.exp(-0.5 * ((middle - mean) / sd) ** 2) / (sd * np.sqrt(2 * np.pi))
    return Histogram(edges, counts, number * density * np.diff(edges), mean, sd)


def star_means(result: Result) -> Iterator[tuple[str, Floats, Floats, tuple[float, float]]]:
    """Yield star, mean coordinates, mean residual, its radial and tangential parts, m."""
    for i, star in enumerate(result.problem.star_ids):
        chosen = result.problem.image_stars == i
        if chosen.sum() > 1:
            mean, v = (
                result.problem.image_xy[chosen].mean(axis=0),
                result.solved.residuals[chosen].mean(axis=0),
            )
            cos, sin = mean / max(float(np.hypot(*mean)), 1e-300)
            yield star, mean, v, (float(v[0] * cos + v[1] * sin), float(-v[0] * sin + v[1] * cos))


@dataclass(frozen=True, eq=False)
class ComparatorFrame:
    angle: float  # From the axes of the plate coordinates to these, from x towards y; radians
    scale_x: float  # Principal distances along the axes over their mean
    scale_y: float
    epsilon: float  # Nonperpendicularity of the axes, radians; the value of the calibration at the angle zero
    covariance: Floats  # (3, 3) covariance of these three

    @property
    def mean_errors(self) -> tuple[float, float, float]:
        x, y, epsilon = np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).tolist()
        return x, y, epsilon


def comparator_frame(result: Result, angle: float) -> ComparatorFrame:
    """Transform the affinity of a calibration to comparator axes (equations 35 to 42).

    Let A = [[cx / c, -epsilon], [0, cy / c]], c the mean of cx and cy, and R the rotation to the new axes.
    The scales are the diagonal of R A R^T, and epsilon is minus the sum of its other two elements. Their
    difference is a rotation, which kappa absorbs. The angle is from the axes of the plate coordinates to the
    new ones, from x towards y, radians.
    """
    values = result.parameters
    epsilon, cx, cy = values["epsilon"], values["cx"], values["cy"]
    if result.problem.options.common_scale:
        cy = cx
    total = cx + cy
    cos2, sin2, both = math.cos(angle) ** 2, math.sin(angle) ** 2, math.sin(angle) * math.cos(angle)
    # Rows: scale x, scale y, epsilon; columns: cx / c, cy / c, epsilon.
    turned = np.array([[cos2, sin2, -both], [sin2, cos2, both], [2 * both, -2 * both, cos2 - sin2]])
    # c is the mean: cx / c = 2 cx / (cx + cy), which changes by the negative of cy / c.
    change = 2.0 / total**2 * np.array([[0, cy, -cx], [0, -cy, cx], [0, 0, 0]])
    change[2, 0] = 1.0
    chosen = [INDEX[name] for name in ("epsilon", "cx", "cy")]
    covariance = result.covariance[np.ix_(chosen, chosen)]
    if result.problem.options.common_scale:
        change[:2] = 0.0
    gradient = turned @ change
    scale_x, scale_y, oblique = turned @ np.array([2 * cx / total, 2 * cy / total, epsilon])
    return ComparatorFrame(
        angle, float(scale_x), float(scale_y), float(oblique), gradient @ covariance @ gradient.T
    )
