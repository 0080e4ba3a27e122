"""Probability of chance matches of images and catalogue stars (cf. D. Lang et al., Astron. J. 139, 2010).

For a wrong hypothesis of the attitude, the number of stars in the tolerance area of an image is Poisson. Its
mean is mu = density x area, so an image matches with p = 1 - exp(-mu). h of n images define the hypothesis
and match by construction. The probability that at least k images match one to one is P(Bin(n - h, p) >= k -
h). Among T hypotheses, this is T times as frequent.
"""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices

ACCEPTED = 1e-6  # Expected number of equally good chance matches below which an exposure is accepted
DOUBTFUL = 1e-2  # Expected number up to which a rejected exposure may show the stars
LOG_ODDS = math.log(1e9)  # Odds of acceptance by D. Lang et al.
CERTAIN = 0.95  # Star probability required for an image before the camera is calibrated
FALSE = 0.1  # fraction of images without a star, for single images
_WRONG = 0.25  # fraction of images without a star, in the odds of an exposure
_REACH = 6.0  # reach of a second star, in standard deviations
CROWDED = 0.3  # Largest number of catalogue stars in a tolerance area that permits counting


def chance(images: int, fixing: int, mu: float, matched: int) -> float:
    """Return the probability that a wrong hypothesis matches `matched` images or more.

    Matches are one to one, `fixing` images define the hypothesis, and mu is the mean number of catalogue
    stars in a tolerance area.
    """
    trials, least = images - fixing, matched - fixing
    return binomial_tail(trials, -math.expm1(-mu), least)


def binomial_tail(trials: int, probability: float, least: int) -> float:
    """Return the binomial probability of at least `least` successes."""
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
    """Return the expected number of wrong hypotheses with an equal match: E = T P."""
    return hypotheses * chance(images, fixing, mu, matched)


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
