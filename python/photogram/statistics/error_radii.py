"""Radii within which errors lie with a probability: linear (LE), circular (CE) and spherical (SE).

*From a covariance* they follow by integrals of the normal distribution; *from a sample* they are order
statistics. A bias is part of the matrix of mean products, `sum d d' / n`, of which a radius is one *from
moments*; that of the covariances that an adjustment predicts holds for the mean of their points.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import numbers
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.statistics import normal_radii
from photogram.statistics.distributions import critical_normal

__all__ = [
    "circular_error",
    "linear_error",
    "mixture_circular",
    "mixture_linear",
    "sample_radius",
    "spherical_error",
    "upper_order",
]

INDEFINITE = 1e-9
"""Of the largest variance: a more negative one, or a larger asymmetry, is no rounding error."""


def linear_error(sd: ArrayLike, probability: float) -> Floats:
    """Return what the size of a normal error does not exceed with a probability: LE90 is 1.6449 sd.

    Parameters
    ----------
    sd
        (n,) standard deviations, in any unit; NaN where one is not known.
    probability
        Between 0 and 1.

    Returns
    -------
    (n,) in the same unit.

    Raises
    ------
    InputError
        What is no such array, a negative standard deviation, another probability.
    """
    return critical_normal(1 - _probability(probability)) * _deviations(sd)


def circular_error(covariances: ArrayLike, probability: float, offsets: ArrayLike | None = None) -> Floats:
    """Return the radii of the circles that hold errors in the plane with a probability (CE90, CE95).

    Parameters
    ----------
    covariances
        (n, 2, 2), possibly singular; an error that is not known is NaN.
    probability
        Between 0 and 1.
    offsets
        (n, 2) means of the errors; zero where it is not given.

    Returns
    -------
    (n,) in the unit of the standard deviations; NaN where a covariance or an offset is.

    Raises
    ------
    InputError
        Arrays of other shapes, a matrix that is no covariance (with its row), another probability.
    """
    return normal_radii.radii(*_principal(covariances, offsets, 2), _probability(probability))


def spherical_error(covariances: ArrayLike, probability: float) -> Floats:
    """Return the radii of the spheres that hold errors in space with a probability (SE90).

    Parameters
    ----------
    covariances
        (n, 3, 3), as those of :func:`circular_error`.
    probability
        Between 0 and 1.

    Returns
    -------
    (n,)
        As those of :func:`circular_error`.

    Raises
    ------
    InputError
        As of :func:`circular_error`.
    """
    return normal_radii.radii(*_principal(covariances, None, 3), _probability(probability))


def mixture_circular(covariances: ArrayLike, probability: float) -> float:
    """Return the radius that holds the error of a point taken at random among some, in the plane.

    Parameters
    ----------
    covariances
        (n, 2, 2) of the points.
    probability
        The mean of those of the points.

    Returns
    -------
    In the unit of the standard deviations; NaN where one is not known, or there is no point.

    Raises
    ------
    InputError
        As of :func:`circular_error`.
    """
    return normal_radii.mixture(_principal(covariances, None, 2)[0], _probability(probability))


def mixture_linear(sd: ArrayLike, probability: float) -> float:
    """Return what the size of the error of a point taken at random does not exceed with a probability.

    Parameters
    ----------
    sd
        (n,) standard deviations of the points.
    probability
        The mean of those of the points.

    Returns
    -------
    In the unit of the standard deviations; NaN where one is not known, or there is no point.

    Raises
    ------
    InputError
        As of :func:`linear_error`.
    """
    return normal_radii.mixture(_deviations(sd)[:, np.newaxis], _probability(probability))


def sample_radius(values: ArrayLike, probability: float) -> tuple[int, float]:
    """Return the order statistic that holds a share of the sizes of errors, without interpolation.

    Parameters
    ----------
    values
        (n,) errors or their lengths: their sizes count.
    probability
        p, between 0 and 1.

    Returns
    -------
    The order k = ceil(p n) from 1, and the k-th of the sizes.

    Raises
    ------
    InputError
        No values, one that is not finite, another probability.
    """
    sizes = np.abs(numbers("values", values))
    if sizes.ndim != 1 or not sizes.size or not np.isfinite(sizes).all():
        raise InputError("values is not a list of finite numbers, one at least")
    # The product of decimal fractions may be larger than a whole number by rounding: 0.07 of 100.
    order = max(math.ceil(_probability(probability) * sizes.size - 1e-9), 1)
    return order, float(np.partition(sizes, order - 1)[order - 1])


def upper_order(count: int, probability: float, confidence: float = 0.95) -> int | None:
    """Return the order statistic that is not less than a quantile with a confidence.

    The values are taken as independent.

    Parameters
    ----------
    count
        n values.
    probability
        p of the quantile.
    confidence
        That of the bound.

    Returns
    -------
    The smallest k, from 1, with BinomialCDF(k - 1; n, p) at least the confidence; None where n is too small.

    Raises
    ------
    InputError
        A negative count, or what is no probability.
    """
    p = _probability(probability)
    if count < 0:
        raise InputError(f"the count of values is not negative: {count}")
    above = np.arange(count)
    ratios = np.log((count - above) / (above + 1)) + math.log(p) - math.log1p(-p)
    logs = count * math.log1p(-p) + np.concatenate([[0.0], np.cumsum(ratios)])
    order = int(np.searchsorted(np.cumsum(np.exp(logs)), _probability(confidence))) + 1
    return order if order <= count else None


def _probability(value: float) -> float:
    if not 0 < value < 1:
        raise InputError(f"a probability lies between 0 and 1: {value:g}")
    return value


def _deviations(sd: ArrayLike) -> Floats:
    """Return (n,) standard deviations."""
    found = numbers("sd", sd, missing=True)
    if found.ndim != 1:
        raise InputError(f"sd has the shape {found.shape}, not (n,)")
    if (found < 0).any():
        raise InputError(f"sd[{np.argmax(found < 0)}] is negative")
    return found


def _principal(covariances: ArrayLike, offsets: ArrayLike | None, size: int) -> tuple[Floats, Floats]:
    """Return (n, k) standard deviations along the principal axes, the largest first, and means along them."""
    given = numbers("covariances", covariances, missing=True)
    if given.ndim != 3 or given.shape[1:] != (size, size):
        raise InputError(f"covariances has the shape {given.shape}, not (n, {size}, {size})")
    means = np.zeros(given.shape[:2]) if offsets is None else numbers("offsets", offsets, missing=True)
    if means.shape != given.shape[:2]:
        raise InputError(f"offsets has the shape {means.shape}, not {given.shape[:2]}")
    rows = np.column_stack([given.reshape(-1, size * size), means])
    known: Bools = np.logical_and.reduce(np.isfinite(rows), axis=1)
    finite = np.where(known[:, np.newaxis, np.newaxis], given, np.eye(size))
    values, vectors = np.linalg.eigh((finite + np.swapaxes(finite, 1, 2)) / 2)
    asymmetry = np.abs(finite - np.swapaxes(finite, 1, 2)).max(axis=(1, 2), initial=0.0)
    bad = np.flatnonzero(np.maximum(asymmetry, -values[:, 0]) > INDEFINITE * np.abs(values).max(axis=1))
    if bad.size:
        raise InputError(f"covariances[{bad[0]}] is not symmetric and positive semidefinite")
    sds = np.where(known[:, np.newaxis], np.sqrt(np.maximum(values[:, ::-1], 0.0)), np.nan)
    return sds, np.einsum("nij,ni->nj", vectors[:, :, ::-1], means)
