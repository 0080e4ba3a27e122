"""Variance components and functions of blocks and, by registration, of collections."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.adjustment.adjustment import adjust, adjusted, at_least
from photogram.arguments.arrays import shaped
from photogram.arguments.objects import kind_error
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.motion import focal_images
from photogram.network.observations.observation import Observation
from photogram.results.components import Bin, VarianceComponents, VarianceFunction
from photogram.results.grouping import (
    Grouping,
    GroupsArgument,
    Left,
    Probing,
    group_sums,
    grouped,
    observables,
)
from photogram.results.network import AdjustedNetwork
from photogram.statistics.components import LEAST_REDUNDANCY, Estimate, Settings, estimate
from photogram.statistics.variance_function import estimate_function
from photogram.words import phrase

NOTHING = 1e-6  # Redundancy below this value is rounding
OTHERS = "all other observations"  # Name of the rest group
DECREASE = 1e-12  # Relative decrease of the sum of squares that ends the adjustment of a collection
SHARPER = 1e-2  # Tolerance of adjustments (standard deviations) relative to the tolerance of components


class Weighing:
    """Repeated adjustment of a network with other weights, each from the previous state."""

    def __init__(self, network: object, *, threads: int | None, tolerance: float) -> None:
        self.result: AdjustedNetwork
        if isinstance(network, Block):
            self.result = adjust(network, tolerance=tolerance, threads=threads)
        elif hasattr(network, "_adjust"):
            self.result = network._adjust(tolerance=DECREASE, threads=threads)
        else:
            raise kind_error("network", "a Block or a Collection", network)
        self.first = self.result
        self.given: Any = self.result.given
        self.network: Any = self.given
        self.threads = threads

    def adjust(self, network: Any) -> AdjustedNetwork:
        """Adjust the network with other weights."""
        self.network = network
        again = partial(adjusted, network) if isinstance(network, Block) else network._adjust_again
        self.result = again(self.result.options, start=self.result.state, threads=self.threads)
        return self.result


def scaled(network: Any, grouping: Grouping, factors: Floats) -> Any:
    """Return a block or collection with the variances of (G,) groups multiplied by factors."""
    if not isinstance(network, Block):
        return network._scaled(grouping, factors)
    block = network
    roots = np.sqrt(factors)
    of_photos = grouping.factors(roots, grouping.photos)
    of_observations = grouping.factors(factors, grouping.observations)
    observations = [
        each if factor == 1 else _scaled(each, float(factor))
        for each, factor in zip(block.observations, of_observations, strict=True)
    ]
    return block.replace(
        image_sd=block.image_sd * grouping.factors(roots, grouping.images),
        point_sd=block.point_sd * grouping.factors(roots, grouping.points),
        photo_position_sd=block.photo_position_sd * of_photos[:, :3],
        photo_attitude_sd=block.photo_attitude_sd * of_photos[:, 3:],
        observations=observations,
    )


def _scaled(observation: Observation, factor: float) -> Observation:
    found = copy.copy(observation)
    changes = {"precision": observation.precision * factor}
    for name, by in (("sd", np.sqrt(factor)), ("covariance", factor)):
        given = getattr(observation, name, None)
        if given is not None:
            changes[name] = np.asarray(given) * by
    for name, value in changes.items():
        object.__setattr__(found, name, value)
    return found


def variance_components(
    network: object,
    groups: GroupsArgument | Grouping = "kind",
    *,
    held: Sequence[str] = (),
    tolerance: float = 1e-4,
    max_steps: int = 100,
    least_redundancy: float = LEAST_REDUNDANCY,
    level: float = 0.05,
    equality: bool = True,
    probing: Probing | None = None,
    threads: int | None = None,
    progress: Callable[[int, Floats], None] | None = None,
) -> VarianceComponents:
    """Estimate variance components: factors of the variances of groups of observations.

    The iteration combines steps of Foerstner with a step of Helmert every fifth time. At the fixed point, the
    weighted sum of squares in every group is the sum of its redundancy numbers. Each adjustment continues the
    previous one. Remove gross errors first (docs/weights.md).

    Parameters
    ----------
    network
        The block or collection.
    groups
        `kind`, `camera`, `strip`, `photo`, `point class`, `rays`, `component` (x and y; plan and height of
        control; positions and attitudes), a list of these for all combinations, or a mapping with your own
        labels of `images`, `control`, `stations`, `observations`.
    held
        Groups with fixed variances.
    tolerance, max_steps, least_redundancy, level, equality
        As in `photogram.statistics.components.Settings`.
    probing
        Computation of the Helmert matrix: seed and number of random vectors.
    threads
        As in :func:`photogram.adjust`.
    progress
        Called with number and factors after each adjustment; an exception that it raises stops the work.

    Returns
    -------
    Components with standard deviations, intervals and tests, merged or fixed groups with reasons, and the
    network with the new weights and its adjustment.

    Raises
    ------
    InputError
        If the network is invalid, a group does not exist, or redundancy is missing.
    AdjustmentError, RankError
        As in the adjustment.
    """
    settings = Settings(tolerance, max_steps, least_redundancy, level, equality)
    grouping = grouped(observables(network), groups)
    names = grouping.groups.names
    if unknown := [name for name in held if name not in names]:
        raise InputError(phrase("weighting.unknown-group", group=unknown[0], groups=list(names)))
    own = Weighing(network, threads=threads, tolerance=min(1e-5, SHARPER * settings.tolerance))
    number = 0

    def adjusted(factors: Floats) -> Left:
        nonlocal number
        result = own.adjust(scaled(own.given, grouping, factors[:-1])) if number else own.first
        if not np.isfinite(result.redundancy[result.used_images]).all():
            raise InputError(phrase("weighting.undetermined"))
        if progress is not None:
            progress(number, factors[:-1].copy())
        number += 1
        return Left(result, grouping, probing or Probing())

    found = estimate(
        adjusted,
        replace(
            grouping.groups,
            names=(*names, OTHERS),
            parents=(*grouping.groups.parents, ""),
            images=(*grouping.groups.images, False),
            held={names.index(name): "as asked" for name in held} | {len(names): "its weights are given"},
        ),
        settings,
    )
    if not any(each.redundancy > 0 for each in found.components):
        raise InputError(phrase("weighting.no-redundancy"))
    last = own.adjust(scaled(own.given, grouping, found.factors[:-1]))
    return VarianceComponents(_without_nothing(found), own.network, last, own.first)


def _without_nothing(found: Estimate) -> Estimate:
    """Remove the rest group if it is empty."""
    keep = [each.name != OTHERS or each.redundancy > NOTHING for each in found.components]
    components = tuple(each for each, kept in zip(found.components, keep, strict=True) if kept)
    messages = [each for each in found.messages if keep[-1] or each.fields.get("name") != OTHERS]
    matrix = found.matrix[np.ix_(keep, keep)]
    return replace(found, components=components, messages=messages, matrix=matrix, factors=found.factors[:-1])


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
    inside = [(places == place) & result.used_images for place in range(count)]
    return tuple(
        Bin.of(sums[f"{place:03d}"], float(values[own].mean()), float(np.average(factors[own])))
        for place, own in enumerate(inside)
        if own.any()
    )
