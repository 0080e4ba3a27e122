"""Whether images match catalogue stars by chance (D. Lang et al., Astron. J. 139, 2010, count likewise).

After a wrong hypothesis of the attitude the number of catalogue stars in the tolerance area of an image is
Poisson with mean mu = density x area, so an image matches with p = 1 - exp(-mu). Of n images, h of which
fixed the hypothesis and match by construction, at least k match one to one with the probability
P(Bin(n - h, p) >= k - h); among T hypotheses T times as often.
"""

from __future__ import annotations

import math

__all__ = ["ACCEPTED", "CROWDED", "chance", "expected_false"]

ACCEPTED = 1e-6
"""Expected number of equally good chance matches below which an exposure is accepted."""
CROWDED = 0.3
"""Catalogue stars in a tolerance area above which counting cannot tell."""


def chance(images: int, fixing: int, mu: float, matched: int) -> float:
    """Return the probability that one wrong hypothesis matches at least as many images.

    Parameters
    ----------
    images, matched
        Images that were compared, and those with a star, one to one.
    fixing
        Images that the hypothesis was made from.
    mu
        Mean number of catalogue stars in a tolerance area.
    """
    trials, least = images - fixing, matched - fixing
    if least <= 0:
        return 1.0
    if least > trials or mu <= 0:
        return 0.0
    log_p, log_q = math.log(-math.expm1(-mu)), -mu
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
