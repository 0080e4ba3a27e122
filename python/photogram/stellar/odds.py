"""Whether images match catalogue stars by chance (D. Lang et al., Astron. J. 139, 2010, count likewise).

After a wrong hypothesis of the attitude the number of catalogue stars in the tolerance area of an image is
Poisson with mean mu = density x area, so an image matches with p = 1 - exp(-mu). Of n images, h of which
fixed the hypothesis and match by construction, at least k match one to one with the probability
P(Bin(n - h, p) >= k - h); among T hypotheses T times as often.
"""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices

ACCEPTED = 1e-6  # Expected number of equally good chance matches below which an exposure is accepted
DOUBTFUL = 1e-2  # Expected number up to which an exposure that is not accepted may show the stars
LOG_ODDS = math.log(1e9)  # Odds of acceptance by D. Lang et al.
CERTAIN = 0.95  # Probability of a star that an image requires before the camera is calibrated
FALSE = 0.1  # share of images without a star, for single images
_WRONG = 0.25  # the same in the odds of an exposure
_REACH = 6.0  # standard deviations within which a second star counts
CROWDED = 0.3  # Largest number of catalogue stars in a tolerance area that counting permits


def chance(images: int, fixing: int, mu: float, matched: int) -> float:
    """Return the probability that one wrong hypothesis matches at least as many images, one to one.

    It was made from `fixing` images; mu is the mean number of catalogue stars in a tolerance area.
    """
    trials, least = images - fixing, matched - fixing
    return binomial_tail(trials, -math.expm1(-mu), least)


def binomial_tail(trials: int, probability: float, least: int) -> float:
    """Return the probability of at least so many of some trials, summed in logarithms."""
    if least <= 0:
        return 1.0
    if least > trials or probability <= 0:
        return 0.0
    if probability >= 1:
        return 1.0
    log_p, log_q = math.log(probability), math.log1p(-probability)
    terms = [
        math.lgamma(trials + 1)
        - math.lgamma(k + 1)
        - math.lgamma(trials - k + 1)
        + k * log_p
        + (trials - k) * log_q
        for k in range(least, trials + 1)
    ]
    largest = max(terms)
    return min(1.0, math.exp(largest) * math.fsum(math.exp(term - largest) for term in terms))


def expected_false(images: int, fixing: int, mu: float, matched: int, hypotheses: float) -> float:
    """Return how many of so many wrong hypotheses match at least as many images: E = T P."""
    return hypotheses * chance(images, fixing, mu, matched)


def _normal(off: Floats, sd: float) -> Floats:
    """Return the density of an image so far from its star, the same in x and y."""
    return np.asarray(np.exp(-0.5 * (off / sd) ** 2) / (math.tau * sd**2), float)


def star_probabilities(
    images: Floats, predicted: Floats, found: Indices, sd: float, density: float
) -> Floats:
    """Return the probability (m,) that images (m, 2) show their stars `found` among predicted ones (n, 2).

    With f, the density of the image about its star, f' about the next one, and the probability q = 0.1 of a
    false image that has a star by chance: (1 - q) f / ((1 - q) (f + f') + q rho), rho being the density of
    the stars, in stars a unit of area. It is NaN without a star (-1). `sd` is that of an image.
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
    """Return the logarithm of the odds of an exposure against chance: each image is a star's or a false one.

    The sum of ln(w f / rho + 1 - w), with w = 0.75, the density f of an image about its star and rho of the
    stars. `off` are distances of images from their stars, without those of no star, `images` counts all
    images.
    """
    density = max(density, 1e-300)
    of_stars = np.log((1 - _WRONG) * _normal(np.asarray(off, float), sd) / density + _WRONG)
    return float(of_stars.sum()) + (images - len(off)) * math.log(_WRONG)
