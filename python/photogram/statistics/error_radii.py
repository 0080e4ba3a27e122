"""Radii of errors for a probability: linear (LE), circular (CE), spherical (SE).

*From a covariance*, radii are integrals of the normal distribution; *from a sample*, they are order
statistics. A radius *from moments* uses the matrix of mean products, `sum d d' / n`, which includes a bias. A
radius from predicted covariances refers to the mean of their points.

An error with the principal standard deviations a >= b and the mean m does not exceed R with the probability

    P(R) = integral of n(y; m2, b) [Phi((w - m1)/a) + Phi((w + m1)/a) - 1] dy over |y| < R,  w^2 = R^2 - y^2.

In space, the probability of the circle of radius w replaces the bracket, with y along the shortest axis. With
y = R sin t the integrand is smooth up to its end. The bracket is 1 for large w. The remaining interval has a
few standard deviations of y for any ratio of the axes. So few Gauss-Legendre nodes suffice, also for axes
without error and for large means. dP/dR is the same integral, over t, of R n(y; m2, b) and the derivative of
the bracket by w. P(R) = p is solved for all points together, by Newton's method between bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import argument_error, numbers, shaped, value_field
from photogram.arguments.arrays import probability as checked_probability
from photogram.arguments.types import Bools, Floats
from photogram.statistics.distributions import critical_normal

INDEFINITE = 1e-9  # Largest negative variance or asymmetry by rounding, as a part of the largest variance


def linear_error(sd: ArrayLike, probability: float) -> Floats:
    """Return the bound of a normal error for a probability: LE90 is 1.6449 sd.

    Parameters
    ----------
    sd
        (n,) standard deviations, in any unit; NaN if unknown.
    probability
        Between 0 and 1.

    Returns
    -------
    (n,) in the same unit.

    Raises
    ------
    InputError
        If `sd` is not such an array, a standard deviation is negative, or the probability is invalid.
    """
    deviations = shaped("sd", sd, (None,), "sd", missing=True)
    return critical_normal(1 - checked_probability("probability", probability)) * deviations


def circular_error(covariances: ArrayLike, probability: float, offsets: ArrayLike | None = None) -> Floats:
    """Return circle radii that contain plane errors with a probability (CE90, CE95).

    Parameters
    ----------
    covariances
        (n, 2, 2), possibly singular; NaN if unknown.
    probability
        Between 0 and 1.
    offsets
        (n, 2) means of the errors; default zero.

    Returns
    -------
    (n,) in the unit of the standard deviations; NaN if a covariance or an offset is.

    Raises
    ------
    InputError
        If shapes differ, a matrix is not a covariance (named with its row), or the probability is invalid.
    """
    return _radii(*_principal(covariances, offsets, 2), checked_probability("probability", probability))


def spherical_error(covariances: ArrayLike, probability: float) -> Floats:
    """Return sphere radii that contain spatial errors with a probability (SE90).

    Parameters
    ----------
    covariances
        (n, 3, 3), as in :func:`circular_error`.
    probability
        Between 0 and 1.

    Returns
    -------
    (n,)
        As in :func:`circular_error`.

    Raises
    ------
    InputError
        As in :func:`circular_error`.
    """
    return _radii(*_principal(covariances, None, 3), checked_probability("probability", probability))


def mixture_circular(covariances: ArrayLike, probability: float) -> float:
    """Return the radius that contains the plane error of a random point.

    Parameters
    ----------
    covariances
        (n, 2, 2) of the points.
    probability
        Mean of the probabilities of the points.

    Returns
    -------
    In the unit of the standard deviations; NaN if one is unknown, or without points.

    Raises
    ------
    InputError
        As in :func:`circular_error`.
    """
    return _mixture(_principal(covariances, None, 2)[0], checked_probability("probability", probability))


def mixture_linear(sd: ArrayLike, probability: float) -> float:
    """Return the bound of the absolute error of a random point for a probability.

    Parameters
    ----------
    sd
        (n,) standard deviations of the points.
    probability
        Mean of the probabilities of the points.

    Returns
    -------
    In the unit of the standard deviations; NaN if one is unknown, or without points.

    Raises
    ------
    InputError
        As in :func:`linear_error`.
    """
    deviations = shaped("sd", sd, (None,), "sd", missing=True)
    return _mixture(deviations[:, np.newaxis], checked_probability("probability", probability))


def sample_radius(values: ArrayLike, probability: float) -> tuple[int, float]:
    """Return the order statistic that bounds a share of the sizes of errors.

    Parameters
    ----------
    values
        (n,) errors or their lengths; absolute values are used.
    probability
        p, between 0 and 1.

    Returns
    -------
    The order k = ceil(p n) from 1, and the k-th of the sizes.

    Raises
    ------
    InputError
        If `values` is empty, a value is not finite, or the probability is invalid.
    """
    sizes = np.abs(numbers("values", values))
    if sizes.ndim != 1 or not sizes.size or not np.isfinite(sizes).all():
        raise argument_error("values", "kind", kind="a list of finite numbers", value=value_field(values))
    # The product of decimal fractions may exceed a whole number by rounding: 0.07 of 100.
    order = max(math.ceil(checked_probability("probability", probability) * sizes.size - 1e-9), 1)
    return order, float(np.partition(sizes, order - 1)[order - 1])


def upper_order(count: int, probability: float, confidence: float = 0.95) -> int | None:
    """Return the order statistic that bounds a quantile above with a confidence.

    The values are assumed to be independent.

    Parameters
    ----------
    count
        n values.
    probability
        p of the quantile.
    confidence
        Confidence of the bound.

    Returns
    -------
    The smallest k, from 1, with BinomialCDF(k - 1; n, p) at least the confidence; None if n is too small.

    Raises
    ------
    InputError
        If the count is negative, or a probability is invalid.
    """
    p = checked_probability("probability", probability)
    if count < 0:
        raise argument_error("count", "not-negative", value=count)
    above = np.arange(count)
    ratios = np.log((count - above) / (above + 1)) + math.log(p) - math.log1p(-p)
    logs = count * math.log1p(-p) + np.concatenate([[0.0], np.cumsum(ratios)])
    order = int(np.searchsorted(np.cumsum(np.exp(logs)), checked_probability("confidence", confidence))) + 1
    return order if order <= count else None


def _principal(covariances: ArrayLike, offsets: ArrayLike | None, size: int) -> tuple[Floats, Floats]:
    """Return (n, k) principal standard deviations, largest first, and means along them."""
    given = shaped("covariances", covariances, (None, size, size), missing=True)
    means = shaped("offsets", 0.0 if offsets is None else offsets, given.shape[:2], missing=True)
    rows = np.column_stack([given.reshape(-1, size * size), means])
    known: Bools = np.logical_and.reduce(np.isfinite(rows), axis=1)
    finite = np.where(known[:, np.newaxis, np.newaxis], given, np.eye(size))
    values, vectors = np.linalg.eigh((finite + np.swapaxes(finite, 1, 2)) / 2)
    asymmetry = np.abs(finite - np.swapaxes(finite, 1, 2)).max(axis=(1, 2), initial=0.0)
    bad = np.flatnonzero(np.maximum(asymmetry, -values[:, 0]) > INDEFINITE * np.abs(values).max(axis=1))
    if bad.size:
        raise argument_error(f"covariances[{bad[0]}]", "covariance-singular")
    sds = np.where(known[:, np.newaxis], np.sqrt(np.maximum(values[:, ::-1], 0.0)), np.nan)
    return sds, np.einsum("nij,ni->nj", vectors[:, :, ::-1], means)


REACH = 8.6  # In standard deviations; the probability beyond is less than the rounding of 1
CENTRED_NODES = 24  # For an integral over at most `REACH` standard deviations, accurate to 1e-12
NODES = 40  # For an integral over twice as many
LEAST_RATIO = 1e-7
"""Least ratio of an axis to the largest; shorter axes are lengthened.

For probabilities above 0.01, this changes radii by less than 1e-10 of them."""
STEPS = 100
CONVERGED = 1e-11  # Largest relative size of the last step of a radius


def _radii(sds: Floats, means: Floats, probability: float) -> Floats:
    """Return the radii of errors with (n, k) principal standard deviations and means."""
    # Radius of a constant error.
    found: Floats = np.linalg.norm(means, axis=1) + 0 * sds[:, 0]
    some = sds[:, 0] > 0
    scale = sds[some, :1]
    units = np.maximum(sds[some] / scale, LEAST_RATIO), means[some] / scale
    bounds = np.linalg.norm(units[1], axis=1) + _widest(probability, sds.shape[1])
    starts = np.minimum(_approximate(*units, probability), bounds)
    found[some] = scale[:, 0] * _solved(lambda trial: _within(trial, *units), starts, bounds, probability)
    return found


def _mixture(sds: Floats, probability: float) -> float:
    """Return the radius with a mean probability over (n, k) standard deviations."""
    if not len(sds) or not np.isfinite(sds).all():
        return math.nan
    moving = sds[:, 0] > 0
    needed = probability * len(sds) - np.count_nonzero(~moving)  # points without error are inside any circle
    if needed <= 0:
        return 0.0
    scale = sds[moving, 0]
    units = np.maximum(sds[moving] / scale[:, np.newaxis], LEAST_RATIO)

    def mean(radius: Floats) -> tuple[Floats, Floats]:
        inside, density = _within(radius / scale, units, np.zeros_like(units))
        return np.mean(inside, keepdims=True), np.mean(density / scale, keepdims=True)

    share = needed / len(scale)
    bound = scale.max(keepdims=True) * _widest(share, sds.shape[1])
    return float(_solved(mean, bound, bound, share)[0])


def _widest(probability: float, size: int) -> float:
    """Return the radius for unit axes, an upper bound if the largest axis is 1."""
    return math.sqrt(_photocore.chi_square_quantile(probability, size, upper=False))


def _approximate(sds: Floats, means: Floats, probability: float) -> Floats:
    """Return (n,) radii of chi-square with the same mean and variance (Satterthwaite).

    The quantile is approximated by Wilson and Hilferty.
    """
    size = (sds**2 + means**2).sum(axis=1)
    spread = 2 / 9 * (sds**4 + 2 * (sds * means) ** 2).sum(axis=1) / size**2
    cube = 1 - spread + NormalDist().inv_cdf(probability) * np.sqrt(spread)
    return np.asarray(np.sqrt(size * np.maximum(cube, 0.0) ** 3))


def _solved(
    function: Callable[[Floats], tuple[Floats, Floats]], starts: Floats, bounds: Floats, probability: float
) -> Floats:
    """Solve increasing functions with derivatives, between 0 and bounds."""
    low, high, trial = np.zeros_like(bounds), bounds, starts
    for _ in range(STEPS if bounds.size else 0):
        inside, density = function(trial)
        more = inside > probability
        low, high = np.where(more, low, trial), np.where(more, trial, high)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            newton = trial + (probability - inside) / density
        ahead = np.where((newton >= low) & (newton <= high), newton, (low + high) / 2)
        last, trial = np.abs(ahead - trial), ahead
        if (last <= CONVERGED * ahead).all():
            break
    return trial


def _within(lengths: Floats, sds: Floats, means: Floats) -> tuple[Floats, Floats]:
    """Return the probabilities of errors not exceeding lengths, and their derivatives.

    Arrays are broadcast: (...) lengths, (..., k) standard deviations, largest first, and means.
    """
    if sds.shape[-1] == 1:
        low, high = (lengths - means[..., 0]) / sds[..., 0], (lengths + means[..., 0]) / sds[..., 0]
        return _normal(low) + _normal(high) - 1, (_density(low) + _density(high)) / sds[..., 0]
    whole, start, width = _window(lengths, sds, means)
    b, mean = sds[..., -1], np.abs(means[..., -1])
    nodes, weights = _rule(NODES if means.any() else CENTRED_NODES)
    t = start[..., np.newaxis] + width[..., np.newaxis] * nodes
    y, w = lengths[..., np.newaxis] * np.sin(t), lengths[..., np.newaxis] * np.cos(t)
    inner, slope = _within(w, sds[..., np.newaxis, :-1], means[..., np.newaxis, :-1])
    own = b[..., np.newaxis], mean[..., np.newaxis]
    both = _density((y - own[1]) / own[0]) + _density((y + own[1]) / own[0])  # signs of y
    both *= weights * (width / b)[..., np.newaxis]
    middle = _normal((whole - mean) / b) - _normal((-whole - mean) / b)
    return np.sum(both * w * inner, axis=-1) + middle, lengths * np.sum(both * slope, axis=-1)


def _window(lengths: Floats, sds: Floats, means: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the y up to which the bracket is 1, and start and length of t beyond."""
    a, b, mean = sds[..., 0], sds[..., -1], np.abs(means[..., -1])
    rest = np.linalg.norm(means[..., :-1], axis=-1)
    whole = _leg(lengths, rest + REACH * a)
    some = _leg(lengths, np.maximum(rest - REACH * a, 0.0))  # beyond, the bracket is 0
    low = np.minimum(np.maximum(whole, mean - REACH * b), lengths)
    high = np.maximum(np.minimum(some, mean + REACH * b), low)
    start = np.arctan2(low, _leg(lengths, low))
    return whole, start, np.arctan2(high, _leg(lengths, high)) - start


@cache
def _rule(count: int) -> tuple[Floats, Floats]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (nodes + 1) / 2, weights / 2


def _leg(hypotenuse: Floats, other: Floats) -> Floats:
    """Return the other leg of right triangles; 0 if imaginary."""
    return np.asarray(np.sqrt(np.maximum((hypotenuse - other) * (hypotenuse + other), 0.0)))


def _density(z: Floats) -> Floats:
    return np.asarray(np.exp(-0.5 * z**2) / math.sqrt(math.tau))


def _normal(z: Floats) -> Floats:
    return _photocore.normal(np.ravel(z)).reshape(z.shape)
