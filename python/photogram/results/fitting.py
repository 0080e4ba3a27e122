"""Fitting features to the points of a result, with their joint covariance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import argument_error, probability, value_field
from photogram.errors import AdjustmentError, InputError, message_of
from photogram.messages import Message, unknown_name
from photogram.results.covariance import Covariances
from photogram.results.features import (
    KINDS,
    Definition,
    Feature,
    Features,
    Quantity,
    directions,
    named_points,
)
from photogram.results.result import Result
from photogram.statistics.distributions import critical_student, log_chi_square, log_fisher
from photogram.words import Phrase, phrase


def features(
    result: Result, definitions: Mapping[str, Definition], *, k: float = 2.0, coverage: float | None = None
) -> Features:
    """Fit distances, lines, planes, circles, spheres and cylinders to adjusted points.

    A feature has the minimum sum of squared distances to its points (Gaussian associated feature). All
    standard deviations follow from the joint covariance of the points (docs/features.md).

    Parameters
    ----------
    result
        An adjusted block with rectangular coordinates.
    definitions
        By the names of features a type (`distance`, `line`, `plane`, `circle`, `sphere`, `cylinder`) with
        names of points, or patterns of names: `{"bore": ("circle", ["hole-*"])}`.
    k
        The coverage factor of U = k sd.
    coverage
        A probability, for example 0.95, instead of k: k is from Student's distribution with the degrees of
        freedom of the variance of unit weight, or from the normal distribution if this variance is known.

    Raises
    ------
    InputError
        If a type or point does not exist, or the points are too few or do not determine a feature.
    AdjustmentError, OutOfMemoryError, KeyboardInterrupt
        As in :meth:`Result.covariances`.
    """
    fitted, empty = _fitting(result, k, coverage)
    found = []
    for name, each in definitions.items():
        try:
            found.append(fitted(name, each))
        except InputError as error:
            raise InputError(_of_feature(name, error)) from None
    return replace(empty, features=tuple(found))


def with_features(result: Result, definitions: Mapping[str, Definition]) -> Result:
    """Return a result with features; its messages explain missing features."""
    if not definitions:
        return result
    found, messages = [], []
    try:
        fitted, empty = _fitting(result, 2.0, None)
    except (InputError, AdjustmentError) as error:
        message = Message(phrase("fit.none", reason=message_of(error)))
        return replace(result, messages=[*result.messages, message])
    for name, each in definitions.items():
        try:
            found.append(fitted(name, each))
        except (InputError, AdjustmentError) as error:
            messages.append(Message(_of_feature(name, error)))
    told = [*result.messages, *messages, *(Message(each) for each in empty.remarks)]
    return replace(result, messages=told, features=replace(empty, features=tuple(found)))


def _of_feature(name: str, error: Exception) -> Phrase:
    return phrase("error.at", what=phrase("fit.named", name=name), message=message_of(error))


def _fitting(
    result: Result, k: float, coverage: float | None
) -> tuple[Callable[[str, Definition], Feature], Features]:
    """Return the fitting function, and the common data of all features."""
    if result.geographic:
        raise InputError(phrase("fit.geographic"))
    freedom = result.freedom_of_scale
    if coverage is not None:
        k = critical_student(1.0 - probability("coverage", coverage), freedom)
    if not 0 < k < math.inf:
        raise argument_error("k", "positive", value=k)
    remarks = (str(phrase("fit.scale")),) if result.datum.has_chosen_scale else ()
    covariances = result.covariances()
    return (
        lambda name, definition: _fitted(result, covariances, name, definition, k, freedom),
        Features((), k, coverage, freedom, remarks),
    )


def _fitted(
    result: Result, covariances: Covariances, name: str, definition: Definition, k: float, freedom: float
) -> Feature:
    if not (isinstance(definition, Sequence) and len(definition) == 2) or isinstance(definition, str):
        raise InputError(phrase("fit.definition", value=value_field(definition)))
    kind, wanted = definition
    if kind not in KINDS:
        raise InputError(unknown_name("kind of feature", str(kind), KINDS))
    block = result.block
    points = named_points([wanted] if isinstance(wanted, str) else wanted, block.point_ids)
    if kind == "distance" and len(points) != 2:
        raise InputError(phrase("fit.two-points", count=len(points)))
    places = {point: row for row, point in enumerate(block.point_ids)}
    rows = np.array([places[point] for point in points], dtype=np.int64)
    for point, used in zip(points, result.used_points[rows].tolist(), strict=True):
        if not used:
            raise InputError(phrase("adjusted.unused-point", point=point))
    joint = covariances.covariance(("point", points))
    own, values, covariance, deviations, test = _photocore.measured_feature(
        kind, result.point_positions[rows], joint
    )
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    quantities = tuple(
        Quantity(called, value, deviation, k * deviation, block.linear_unit if is_length else "")
        for (called, is_length), value, deviation in zip(own, values.tolist(), sd.tolist(), strict=True)
    )
    apart, apart_sd = (deviations[:, first : 2 * len(directions(kind)) : 2] for first in (0, 1))
    found = Feature(name, kind, tuple(points), quantities, covariance, apart, apart_sd)
    if test is None:
        return found
    statistic, beyond = test
    known = math.isinf(freedom)
    log = log_chi_square(statistic, beyond) if known else log_fisher(statistic / beyond, beyond, freedom)
    return replace(found, statistic=statistic, freedom=beyond, probability=math.exp(float(log)))
