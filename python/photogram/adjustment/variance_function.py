"""Variances of image coordinates as a function of the radius or another quantity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogram.adjustment.adjustment import at_least
from photogram.adjustment.components import Weighing
from photogram.arguments.arrays import shaped
from photogram.arguments.objects import kind_error
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.network.motion import focal_images
from photogram.results.components import Bin, VarianceFunction
from photogram.results.grouping import Probing, group_sums, observables
from photogram.results.network import AdjustedNetwork
from photogram.statistics.variance_function import estimate_function
from photogram.words import phrase

TOLERANCE = 1e-6  # Tolerance of the adjustments, in standard deviations


class _Left:
    """Residuals and redundancy of image coordinates after an adjustment."""

    def __init__(self, result: AdjustedNetwork, probing: Probing) -> None:
        self._result, self._probing = result, probing
        with np.errstate(invalid="ignore"):
            self.squares: Floats = ((result.residuals / result.image_given_sd) ** 2).ravel()
        self.redundancy: Floats = np.nan_to_num(result.redundancy).ravel()

    def information(self, terms: Floats) -> Floats:
        """Return (t, t) sums of R_ij^2 c_i c_j^T, estimated with random signs."""
        rows, count = terms.shape
        factor = self._result._factor()
        options = self._probing.options(rows)
        if rows <= options["exact"]:
            columns = np.eye(rows).reshape(rows, -1, 2)
            projected = factor.project_images(columns, threads=0, progress=None).reshape(rows, rows)
            return np.asarray(terms.T @ projected**2 @ terms)
        signs = np.random.default_rng(options["seed"]).choice([-1.0, 1.0], (options["vectors"], rows))
        found = np.empty((count, count))
        for k in range(count):
            columns = (signs * np.sqrt(terms[:, k])).reshape(len(signs), -1, 2)
            projected = factor.project_images(columns, threads=0, progress=None).reshape(len(signs), rows)
            found[:, k] = (projected**2).mean(axis=0) @ terms
        return (found + found.T) / 2


def variance_function(
    network: object,
    of: ArrayLike = "radius",
    *,
    center: Sequence[float] = (0.0, 0.0),
    bins: int = 10,
    max_steps: int = 30,
    probing: Probing | None = None,
    threads: int | None = None,
) -> VarianceFunction:
    """Estimate the image variance as a function of the radius: sigma^2 = a^2 + b^2 r^2.

    Weights of other observations do not change. Squared residuals are regressed on redundancy numbers,
    repeatedly with the new weights, because a single step is badly biased.

    Parameters
    ----------
    network
        Block or collection; the given standard deviations are the unit of a and b.
    of
        `radius`, or (m,) non-negative values, one for each image, which replace the radius.
    center
        Centre of the radius, in the unit of the image coordinates.
    bins
        Number of quantiles of the radius in the comparison with the function.
    max_steps
        Maximum number of adjustments.
    probing
        Computation of the standard deviations.
    threads
        As in :func:`photogram.adjust`.

    Raises
    ------
    InputError
        If the network is invalid, values do not fit, or redundancy is missing.
    AdjustmentError, RankError
        As in the adjustment.
    """
    probing = probing or Probing()
    at_least("bins", bins, 2)
    at_least("max_steps", max_steps, 1)
    images = len(observables(network).given.image_photos)
    own = Weighing(network, threads=threads, tolerance=TOLERANCE)
    values = _values(own, of, center, images)
    used = own.first.used_images
    largest = float(values[used].max(initial=0.0))
    if not largest > 0 or not np.isfinite(own.first.redundancy[used]).all():
        raise InputError(phrase("weighting.no-function"))
    share = np.repeat((values / largest) ** 2, 2)
    terms = np.stack([np.ones(2 * images), share], axis=1)

    def adjusted(factors: Floats) -> _Left:
        if (factors == 1).all():
            return _Left(own.first, probing)
        roots = np.sqrt(factors).reshape(-1, 2)
        return _Left(own.adjust(own.given.replace(image_sd=own.given.image_sd * roots)), probing)

    found = estimate_function(adjusted, terms, max_steps=max_steps)
    shown_bins = _bins(own.result, values, found.factors.reshape(-1, 2)[:, 0], bins, probing)
    name = "radius" if isinstance(of, str) else "value"
    return VarianceFunction(name, largest, found, shown_bins, own.network, own.result)


def _values(own: Weighing, of: ArrayLike, center: Sequence[float], images: int) -> Floats:
    if isinstance(of, str):
        if of != "radius":
            raise kind_error("of", "`radius` or an array", of)
        middle = shaped("center", center, (2,))
        return np.asarray(np.linalg.norm(focal_images(own.network) - middle, axis=1))
    return shaped("of", of, (images,), "not-negative")


def _bins(
    result: AdjustedNetwork, values: Floats, factors: Floats, count: int, probing: Probing
) -> tuple[Bin, ...]:
    """Return quantiles of the values, with residual variances to compare with the function."""
    edges = np.quantile(values[result.used_images], np.linspace(0, 1, count + 1)[1:-1])
    places: Indices = np.searchsorted(edges, values, side="right")
    labels = np.array([f"{place:03d}" for place in places], dtype=object)
    sums = group_sums(result, {"images": labels}, probing=probing)
    found = []
    for place in range(count):
        inside = (places == place) & result.used_images
        if not inside.any():
            continue
        each = sums[f"{place:03d}"]
        middle = float(np.average(factors[inside]))
        found.append(Bin.of(each, float(values[inside].mean()), middle))
    return tuple(found)
