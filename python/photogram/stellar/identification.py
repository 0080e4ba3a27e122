"""Identification of the catalogue stars of an exposure by odds against chance, and attitudes from stars.

Odds are probabilities of chance matches (cf. D. Lang et al., Astron. J. 139, 2010).

For a wrong hypothesis of the attitude, the number of stars in the tolerance area of an image is Poisson. Its
mean is mu = density x area, so an image matches with p = 1 - exp(-mu). h of n images define the hypothesis
and match by construction. The probability that at least k images match one to one is P(Bin(n - h, p) >= k -
h). Among T hypotheses, this is T times as frequent.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.point_sets import mutually_nearest
from photogram.stellar.places import apparent_places, sidereal_time
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure, project_sky
from photogram.stellar.sky_cameras import SkyCamera
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.stellar import Night


_SEEDS = 25  # Brightest images for hypotheses; three times this number support them
_EXACT = 20  # Hypotheses with the most support, which are evaluated exactly
_CANDIDATES, _TURNED = 1500, 800
"""Largest numbers of image-star pairs for hypotheses, with known and unknown roll."""
_DEEPER = 2  # Stars in the frame per image; fainter ones of the catalogue would match only by chance
FEWEST = 3  # Minimum number of images, and of stars, for a match
STRETCH = 0.01  # Largest relative scale error of the approximate camera


@dataclass(frozen=True, eq=False)
class Match:
    """Matched images, and the probability of an equally good match by chance."""

    found: Indices  # (m,) index of the predicted image of each image; -1 for none
    expected: float  # Expected number of equally good matches among all wrong hypotheses
    matched: int  # Counted images, and the matched ones of them
    images: int
    crowded: bool = False  # Whether too many stars in a tolerance area prevent counting
    scale: float = 1.0  # Scale of predicted relative to measured images
    hypotheses: float = 0.0
    stars: int = 0  # Predicted images

    @property
    def accepted(self) -> bool:
        return self.expected < ACCEPTED

    @property
    def doubtful(self) -> bool:
        return not self.accepted and self.expected <= DOUBTFUL

    def reason(self) -> Phrase:
        if self.crowded:
            return phrase("stars.crowded")
        if len(self.found) < FEWEST:
            return phrase("stars.few-images", n=len(self.found), least=FEWEST)
        if self.stars < FEWEST:
            return phrase("stars.few-stars", n=self.stars, least=FEWEST)
        if not math.isfinite(self.expected):
            return phrase("stars.no-pair", images=len(self.found))
        count = {"matched": self.matched, "images": self.images}
        return phrase("stars.by-chance", **count, expected=self.expected, limit=ACCEPTED)


@dataclass(frozen=True, eq=False)
class Search:
    frame: tuple[float, float]  # Width and height
    radius: float  # of an image from its prediction; for unknown roll, of distances from the axis
    stretch: float = STRETCH  # Largest relative scale error
    axis: Floats | None = None  # (2,) the image of the axis if the roll is unknown
    share: float = 1.0  # Fraction of the frame above the horizon
    tried: float = 0.0  # Earlier hypotheses for the same exposure

    def regions(self, predicted: Floats) -> tuple[Bools, float, float]:
        """Return which predicted images are central, the central area, and the total area."""
        width, height = self.frame
        if self.axis is None:
            around = (width + 2 * self.radius) * (height + 2 * self.radius)
            middle = np.asarray(((predicted >= 0) & (predicted <= self.frame)).all(axis=1), bool)
            return middle, width * height * self.share, around * self.share
        inner, outer = 0.5 * min(self.frame), 0.5 * math.hypot(width, height) + self.radius
        middle = np.asarray(np.linalg.norm(predicted - self.axis, axis=1) <= inner, bool)
        return middle, math.pi * inner**2, math.pi * outer**2 * self.share

    def as_deep(self, predicted: Floats, images: int) -> tuple[Floats, float]:
        """Return the brightest predicted images for a number of measured ones, and their density.

        The density is the number of stars per square pixel: in the frame or around it, whichever is larger.
        """
        width, height = self.frame
        _, _, around = self.regions(predicted)
        seen = width * height * self.share
        chosen = predicted[: math.ceil(_DEEPER * max(images, _SEEDS) * around / seen)]
        middle, area, around = self.regions(chosen)
        return chosen, max(int(middle.sum()) / area, len(chosen) / around)

    def candidates(self, measured: Floats, predicted: Floats) -> Bools:
        if self.axis is None:
            return np.asarray(
                np.linalg.norm(measured[:, None] - predicted[None], axis=2) <= self.radius, bool
            )
        own, other = (np.linalg.norm(xy - self.axis, axis=1) for xy in (measured, predicted))
        return np.asarray(np.abs(own[:, None] - other[None]) <= self.radius, bool)


def match(measured: Floats, predicted: Floats, search: Search, *, tolerance: float) -> Match:
    """Match measured star images (m, 2) to predicted ones (n, 2), brightest first.

    Pairs of bright images define similarity transformations between the two sets. The best one is refined by
    cubic polynomials, and the tolerance is the largest distance after these. Two counts are tested against
    chance (:func:`expected_false`). The first counts bright images near a star under the best similarity,
    the second every second image under polynomials fitted to the others. Both account for the total number of
    hypotheses.
    """
    none = Match(np.full(len(measured), -1, np.int64), math.inf, 0, len(measured), stars=len(predicted))
    if min(len(measured), len(predicted)) < FEWEST:
        return none
    seeds = measured[: 3 * _SEEDS]
    bright, density = search.as_deep(predicted, len(seeds))
    made, promising = _similarities(seeds, bright, search, tolerance)
    # Includes both counts and earlier hypotheses.
    hypotheses = 2.0 * made + search.tried
    best, most = None, 2
    for transform in promising:
        found = mutually_nearest(_apply(transform, seeds), bright, 3 * tolerance)
        matched = int((found >= 0).sum())
        if matched > most:
            best, most = transform, matched
    if best is None:
        return replace(none, hypotheses=hypotheses)
    mu = _mean_stars(density, 3 * tolerance)
    expected = math.inf if mu > CROWDED else expected_false(len(seeds), 2, mu, most, hypotheses)
    sky, density = search.as_deep(predicted, len(measured))
    halves = np.arange(len(measured)) % 2 == 0
    again = mutually_nearest(_refined(measured, sky, best, tolerance, halves), sky, tolerance)
    held_out, tested = int((again[~halves] >= 0).sum()), int((~halves).sum())
    # Both images of a pair may be among the excluded ones.
    second = expected_false(tested, 2, _mean_stars(density, tolerance), held_out, hypotheses)
    crowded = _mean_stars(density, tolerance) > CROWDED
    counted = (most, len(seeds))
    if not crowded and second < expected:
        expected, counted = second, (held_out, tested)
    moved = _refined(measured, sky, best, tolerance, np.ones(len(measured), bool))
    return Match(
        _certain(moved, sky, density, tolerance),
        expected,
        *counted,
        crowded=crowded and mu > CROWDED,
        scale=math.hypot(best[0, 0], best[0, 1]),
        hypotheses=hypotheses,
        stars=len(predicted),
    )


def _mean_stars(density: float, tolerance: float) -> float:
    return density * math.pi * tolerance**2


def _certain(moved: Floats, predicted: Floats, density: float, tolerance: float) -> Indices:
    """Match images to stars if no other star is nearly as probable.

    Ambiguous images are matched with the calibrated camera.
    """
    found = mutually_nearest(moved, predicted, tolerance)
    has = found >= 0
    if not has.any():
        return found
    off = moved[has] - predicted[found[has]]
    sd = max(1.4826 * float(np.median(np.abs(off))), 1e-3 * tolerance)
    probability = star_probabilities(moved, predicted, found, sd, density)
    return np.where(has & ~(probability >= CERTAIN), -1, found)


def _refined(measured: Floats, predicted: Floats, start: Floats, tolerance: float, fitted: Bools) -> Floats:
    """Move all images by polynomials fitted to some of them."""
    moved = _apply(start, measured)
    for degree in (1, 1, 2, 3, 3, 3):
        found = mutually_nearest(moved, predicted, 2 * tolerance)
        chosen = (found >= 0) & fitted
        if chosen.sum() < 3:
            return moved
        # At least three matches per coefficient.
        degree = min(degree, 3 if chosen.sum() > 30 else 2 if chosen.sum() > 18 else 1)
        moved = _fitted(measured, chosen, predicted[found[chosen]], degree)
    return moved


def _similarities(
    seeds: Floats, predicted: Floats, search: Search, tolerance: float
) -> tuple[int, list[Floats]]:
    """Return the number of similarities of candidate pairs, and the best ones (3, 2)."""
    makers = seeds[:_SEEDS]
    images, stars = np.nonzero(search.candidates(makers, predicted))
    most = _CANDIDATES if search.axis is None else _TURNED
    if len(images) > most:
        # The brightest images and stars.
        order = np.argsort(images / len(makers) + stars / len(predicted), kind="stable")[:most]
        images, stars = images[order], stars[order]
    made, best = _photocore.star_similarities(
        seeds,
        predicted,
        np.column_stack([images, stars]),
        makers=_SEEDS,
        tolerance=3 * tolerance,
        stretch=search.stretch,
        least=min(search.radius, 0.25 * float(np.ptp(makers, axis=0).max())),
        axis=None if search.axis is None else ((search.axis[0], search.axis[1]), search.radius),
        limit=3 * tolerance,
        wanted=_EXACT,
    )
    return made, [np.array([[a, b], [-b, a], [x, y]]) for a, b, x, y in best]


def _apply(transform: Floats, points: Floats) -> Floats:
    return np.asarray(points @ transform[:2] + transform[2], float)


def _fitted(measured: Floats, chosen: Bools, predicted: Floats, degree: int) -> Floats:
    """Move all images by polynomials: quadratic for tilt, cubic for distortion."""
    x, y = (measured / np.abs(measured).max(initial=1.0)).T
    powers = [(i, k - i) for k in range(degree + 1) for i in range(k + 1)]
    design = np.column_stack([x**i * y**j for i, j in powers])
    return np.asarray(design @ np.linalg.lstsq(design[chosen], predicted, rcond=None)[0], float)


ACCEPTED = 1e-6  # Expected number of equally good chance matches below which an exposure is accepted
DOUBTFUL = 1e-2  # Expected number up to which a rejected exposure may show the stars
LOG_ODDS = math.log(1e9)  # Odds of acceptance by D. Lang et al.
CERTAIN = 0.95  # Star probability required for an image before the camera is calibrated
FALSE = 0.1  # fraction of images without a star, for single images
_WRONG = 0.25  # fraction of images without a star, in the odds of an exposure
_REACH = 6.0  # reach of a second star, in standard deviations
CROWDED = 0.3  # Largest number of catalogue stars in a tolerance area that permits counting


def binomial_tail(trials: int, probability: float, least: int) -> float:
    """Return the binomial probability of at least `least` successes, a probability of F."""
    if least <= 0 or probability >= 1:
        return float(least <= trials)
    if least > trials or probability <= 0:
        return 0.0
    failures = trials - least + 1
    ratio = (1 - probability) * least / (probability * failures)
    return _photocore.fisher(ratio, 2.0 * failures, 2.0 * least)


def expected_false(images: int, fixing: int, mu: float, matched: int, hypotheses: float = 1.0) -> float:
    """Return the expected number of wrong hypotheses that match `matched` images or more: E = T P.

    Matches are one to one, `fixing` images define a hypothesis, and mu is the mean number of catalogue stars
    in a tolerance area.
    """
    return hypotheses * binomial_tail(images - fixing, -math.expm1(-mu), matched - fixing)


def _normal(off: Floats, sd: float) -> Floats:
    """Return the density of an image at a distance from its star, equal in x and y."""
    return np.asarray(np.exp(-0.5 * (off / sd) ** 2) / (math.tau * sd**2), float)


def star_probabilities(
    images: Floats, predicted: Floats, found: Indices, sd: float, density: float
) -> Floats:
    """Return the probability (m,) that images (m, 2) show their matched stars.

    Let f be the density of the image about its star, and f' about the next one. The probability of a false
    image with a star by chance is q = 0.1, and rho is the number of stars per unit of area. The result is (1
    - q) f / ((1 - q) (f + f') + q rho). It is NaN without a star (-1). `found` contains star indices among
    `predicted` (n, 2), `sd` refers to an image.
    """
    probability = np.full(len(images), np.nan)
    has = np.flatnonzero(found >= 0)
    if not len(has):
        return probability
    own = np.linalg.norm(images[has] - predicted[found[has]], axis=1)
    second = _photocore.nearest_points(images[has], predicted, float(own.max()) + _REACH * sd, found[has])
    away = np.where(second >= 0, np.linalg.norm(images[has] - predicted[second], axis=1), np.inf)
    first = _normal(own, sd)
    rest = _normal(away, sd) + FALSE / (1 - FALSE) * density
    probability[has] = first / np.maximum(first + rest, 1e-300)
    return probability


def log_odds(off: Floats, images: int, sd: float, density: float) -> float:
    """Return the logarithmic odds of an exposure with star images and false images.

    It is the sum of ln(w f / rho + 1 - w) with w = 0.75. f is the density of an image about its star, rho the
    density of the stars. `off` contains the distances of matched images from their stars, `images` counts all
    images.
    """
    density = max(density, 1e-300)
    of_stars = np.log((1 - _WRONG) * _normal(np.asarray(off, float), sd) / density + _WRONG)
    return float(of_stars.sum()) + (images - len(off)) * math.log(_WRONG)


_GRID = (24, 16)  # frame points for the search of the sky
_LEAST = 0.02
_SLACK = math.radians(2.0)
STARS_OF_AN_ATTITUDE = 2
_STARS_OF_FIRST_ATTITUDE = 3


def local_directions(standard: Floats) -> Floats:
    """Return unit directions (n, 3) north, east, zenith of standard coordinates."""
    every = np.column_stack([standard, np.ones(len(standard))])
    return np.asarray(every / np.linalg.norm(every, axis=1, keepdims=True), float)


def turned_to(rays: Floats, directions: Floats) -> Floats:
    """Return alpha, omega, kappa that fit camera rays (n, 3) to directions (n, 3).

    Rays have x right, y down and z along the axis, directions are north, east, zenith; only finite rows are
    used. The matrix that maximises the sum of ray' M direction is U diag(1, 1, d) V'. U and V are from the
    singular value decomposition of the sum of ray direction' (S. Umeyama, IEEE PAMI 13, 1991). d is -1 or 1
    so that det M = -1, since the local triad is left-handed.
    """
    finite = np.isfinite(rays).all(axis=1) & np.isfinite(directions).all(axis=1)
    left, _, right = np.linalg.svd(rays[finite].T @ directions[finite])
    sign = -float(np.linalg.det(left) * np.linalg.det(right))
    matrix = left @ np.diag([1.0, 1.0, sign]) @ right
    return _photocore.pointing_of_matrix(np.ascontiguousarray(matrix))


def has_named_stars(exposure: Exposure) -> bool:
    return exposure.stars is not None and int((exposure.stars >= 0).sum()) >= STARS_OF_AN_ATTITUDE


def attitude_of_stars(exposure: Exposure, camera: SkyCamera, night: Night) -> tuple[Floats, float]:
    """Return the attitude from named stars, and the sum of squared misfits.

    Misfits are between unit directions of images under the camera and of their stars.
    """
    stars = exposure.stars
    assert stars is not None
    has = np.flatnonzero(stars >= 0)
    place = night.earth.site_of_date(night.site)
    places = apparent_places(night.catalogue.take(stars[has]), exposure.utc, place.effects)
    time = sidereal_time(place, exposure.utc, night.earth.dut1)
    rays, seen = camera.rays(exposure.xy[has]), local_directions(place.standard_coordinates(places, time))
    attitude = turned_to(rays, seen)
    return attitude, float(np.nansum((rays - seen @ _photocore.pointing_matrix(attitude).T) ** 2))


def sky_share(camera: SkyCamera, attitude: Floats, frame: tuple[float, float]) -> float:
    """Return the fraction of a frame (width, height) above the horizon."""
    x, y = ((np.arange(count) + 0.5) / count * size for count, size in zip(_GRID, frame, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    zenith = camera.rays(grid) @ _photocore.pointing_matrix(np.asarray(attitude, float))[:, 2]
    with np.errstate(invalid="ignore"):
        return max(float(np.mean(zenith > 0)), _LEAST)


def attitude_radius(night: Night) -> float:
    """Return the largest image displacement by attitude errors, pixels."""
    return float(night.camera.values[0]) * math.tan(night.attitude_error)


def stars_near(exposure: Exposure, camera: SkyCamera, site: Site, night: Night, margin: float) -> Indices:
    """Return the indices of catalogue stars around the field of an exposure.

    `margin` is the largest error of the attitude, radians.
    """
    alpha, omega = exposure.attitude[:2]
    if not math.cos(alpha) * math.cos(omega) > 0.02:
        # At or below the horizon standard coordinates are undefined.
        return np.arange(len(night.catalogue.ids))
    axis = np.array([[math.tan(alpha), math.tan(omega) / math.cos(alpha)]])
    ((ra, dec),) = site.places(axis, sidereal_time(site, exposure.utc, night.earth.dut1))
    # Margin for distortion, and for precession over the years.
    reach = 1.1 * camera.largest_angle(night.frame) + margin + _SLACK
    centre = np.array([math.cos(dec) * math.cos(ra), math.cos(dec) * math.sin(ra), math.sin(dec)])
    return np.flatnonzero(night.catalogue.directions @ centre >= math.cos(min(reach, math.pi)))


def identify(
    exposure: Exposure,
    night: Night,
    camera: SkyCamera,
    *,
    tolerance: float,
    stretch: float,
    tried: float = 0.0,
) -> tuple[Match, Indices, Floats]:
    """Identify the catalogue stars of an exposure with an approximate attitude.

    The principal distance of the camera may have the relative error `stretch`. The tolerance is the largest
    distance of image and star after the best polynomials, pixels. `tried` is the number of earlier hypotheses
    about this exposure. Return the match, (k,) indices in the catalogue by the best hypothesis, accepted or
    not, -1 for none, and alpha, omega, kappa from these stars, the given ones if there are too few.
    """
    frame, catalogue, dut1, radius = night.frame, night.catalogue, night.earth.dut1, attitude_radius(night)
    if stretch > STRETCH:
        # The corners may have an equal additional displacement.
        radius += stretch * max(frame)
    site = night.earth.site_of_date(night.site)
    time = sidereal_time(site, exposure.utc, dut1)
    near = stars_near(exposure, camera, site, night, radius / camera.values[0])
    places = apparent_places(catalogue.take(near), exposure.utc, site.effects)
    predicted = project_sky(camera, exposure.attitude, site, places, time)
    axis = None if night.roll_known else camera.values[2:4]
    with np.errstate(invalid="ignore"):
        if axis is None:
            inside = ((predicted >= -radius) & (predicted <= np.array(frame) + radius)).all(axis=1)
        else:
            inside = np.linalg.norm(predicted - axis, axis=1) <= 0.5 * math.hypot(*frame) + radius
    seen = np.flatnonzero(inside)
    share = sky_share(camera, exposure.attitude, frame)
    search = Search(frame, radius, stretch, axis, share, tried)
    matched = match(exposure.xy, predicted[seen], search, tolerance=tolerance)
    local = np.where(matched.found >= 0, seen[matched.found], -1) if len(seen) else matched.found
    rows = np.flatnonzero(local >= 0)
    attitude = exposure.attitude
    if len(rows) >= _STARS_OF_FIRST_ATTITUDE:
        values = camera.values.copy()
        values[:2] /= matched.scale
        rays = replace(camera, values=values).rays(exposure.xy[rows])
        standard = site.standard_coordinates(places[local[rows]], time)
        attitude = turned_to(rays, local_directions(standard))
    stars = np.where(local >= 0, near[local], -1) if len(near) else local
    return matched, stars, attitude
