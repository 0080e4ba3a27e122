"""Evaluation of the reliability of an adjusted network: hypotheses, standard deviations by type, summary."""

from __future__ import annotations

import math
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import finite_rows
from photogram.arguments.types import Floats, Indices
from photogram.results.hypotheses import DETECTION, Hypotheses
from photogram.results.hypothesis_tests import hypotheses
from photogram.results.network_trial import (
    CONTROL,
    IMAGE,
    OBSERVATION,
    Facts,
    LostSupportError,
    NetworkTrial,
    Out,
    Tests,
)
from photogram.results.reliability import Reliability, ReliabilitySummary, downweighted, listed
from photogram.statistics.evidence import MEDIAN
from photogram.statistics.findings import LARGEST_FACTOR, NOMINAL, Text, TypeFactor
from photogram.statistics.limits import global_test
from photogram.statistics.reliability import TESTABLE
from photogram.statistics.weight_rules import wrong_types

if TYPE_CHECKING:
    from photogram.results.network import AdjustedNetwork

MOST_WAITING = 1_000_000  # Groups of a network whose factor and inverse wait for a report

_SHARED = ("level", "power", "known", "suspects", "tests", "standing", "downweighted")


def reliability_summary(result: AdjustedNetwork) -> ReliabilitySummary | None:
    """Return the summary of a network; None without redundancy numbers or convergence."""
    computed = bool(finite_rows(result.redundancy)[result.used_images].all())
    if not (computed and result.converged and result.degrees_of_freedom > 0):
        return None
    refused = LostSupportError, _photocore.BlockError, _photocore.CollectionError
    facts, weight = result._hypothesis_facts(), "known" if result.known_weight else "unknown"
    found = errors = lost = None
    # Other results remain valid; a network that is singular by rounding has a message already.
    with suppress(*refused):
        found = result.reliability(unit_weight=weight)
    if found is not None:
        errors, lost = evaluated(result, found, facts), found.downweighted
    elif result.loss is not None:
        lost = downweighted(result._trial(), result._terms, result.image_weights, result.used_images)
    if lost is not None and (found is None or lost.removed.excessive or lost.unsupported):
        # A common error may be the reason: the loss removes observations that have it.
        trial = result._trial()
        trial.out = Out(np.zeros(len(trial.deviations), dtype=bool))
        with suppress(*refused):
            level, power = DETECTION
            options: dict[str, Any] = {"level": level, "power": power, "unit_weight": weight}
            whole = Reliability(trial, result.covariances, lost, **options)
            # Check points were compared with the robust solution.
            of_whole = evaluated(result, whole, facts | {"agreement": None})
            if of_whole[0].common() or wrong_types(of_whole[1], of_whole[0].odds()):
                found, errors = found or whole, of_whole
    if found is None or errors is None:
        return None
    summary = ReliabilitySummary(
        **{name: getattr(found, name) for name in _SHARED},
        # Plan coordinates may be angles.
        list_groups=partial(listed, found, result._terms.linear_unit, heights=result.geographic),
        hypotheses=errors[0],
        types=tuple(errors[1]),
    )
    if len(found.suspects) > MOST_WAITING:
        summary.listed  # noqa: B018
    return summary


def evaluated(
    result: AdjustedNetwork, found: Reliability, facts: Facts
) -> tuple[Hypotheses, list[TypeFactor]]:
    """Evaluate the hypotheses of the catalogue with some facts, and standard deviations by type."""
    known, limit = result.known_weight, result.max_bias_ratio
    standing = found.standing.sum_and_freedom if known else result.sum_and_freedom
    types = type_factors(found.trial, found.tests, limit, standing) if known else []
    parts = found.trial, found.tests, facts, result._terms.point_axes, standing, limit
    return hypotheses(*parts, known=known), types


MOST_ROWS = 64  # Largest number of observations with an exact sum of R_ij^2
VISIBLE = 1e-6  # Least redundancy of a direction
FACTORS = 100  # Number of examined factors
FEW, WEAK = 20.0, 0.1
"""Redundancy, and mean redundancy, below which chi-square with r degrees of freedom is wrong."""


def type_factors(
    trial: NetworkTrial, tests: Tests, limit: float, standing: tuple[float, float]
) -> list[TypeFactor]:
    """Return the agreement of the standard deviations of each type.

    Images are included if the global test of their sum of squares and degrees of freedom rejects. `limit`:
    undetected factors of standard deviations that matter.
    """
    suspects, test = trial.suspects, global_test(*standing)
    images = test is not None and (test.rejected_high or test.rejected_low)
    used = tests.active & (suspects.kinds <= OBSERVATION) & (images | (suspects.kinds != IMAGE))
    found: dict[Text, list[Indices]] = {}
    for kind in np.unique(suspects.kinds[used]).tolist():
        groups = np.flatnonzero(used & (suspects.kinds == kind))
        if kind != OBSERVATION:
            found[suspects.type(kind, 0)] = [groups]
            continue
        for group in groups.tolist():
            name = suspects.type(kind, int(suspects.subjects[group]))
            found.setdefault(name, []).append(np.array([group]))
    return [_factor(trial, tests, kind, np.hstack(groups), limit) for kind, groups in found.items()]


def _factor(trial: NetworkTrial, tests: Tests, kind: Text, groups: Indices, limit: float) -> TypeFactor:
    """Return the agreement of the standard deviations of some groups."""
    suspects = trial.suspects
    own = np.zeros(len(suspects), dtype=bool)
    own[groups] = True
    rows = np.flatnonzero(np.repeat(own, np.diff(suspects.row_starts)) & np.isfinite(tests.redundancy))
    residuals, redundancy, sd = tests.residual[rows], tests.redundancy[rows], trial.deviations[rows]
    squares, r = float(np.nansum(residuals**2)), float(redundancy.sum())
    with np.errstate(divide="ignore", invalid="ignore"):
        w = np.abs(residuals) / np.sqrt(redundancy)
    w = w[np.isfinite(w) & (redundancy > TESTABLE)]
    is_control = bool(suspects.kinds[groups[0]] == CONTROL)
    equal = suspects.kinds[groups[0]] == IMAGE and len(sd) and np.ptp(sd) <= 1e-9 * sd[0]
    spread, likeliest = math.nan, None
    if len(rows) <= MOST_ROWS and r < max(FEW, WEAK * len(rows)):
        mixed = TypeFactor(kind, squares, r, spread=float(np.square(redundancy).sum()))
        # The squares of R outside the diagonal increase s.
        if squares > NOMINAL**2 * r or (is_control and mixed.undetected > limit):
            within = np.flatnonzero(np.isin(np.hstack([*map(suspects.rows, groups.tolist())]), rows))
            found = trial.core.responses(groups.tolist())[within][:, rows]
            spread, likeliest = float(np.square(found).sum()), _likeliest(found, residuals)
    return TypeFactor(
        kind,
        squares,
        r,
        median=float(np.median(w)) / MEDIAN if w.size else math.nan,
        sd=float(sd[0]) if equal else math.nan,
        unit=suspects.given.image_unit,
        spread=spread,
        likeliest=likeliest,
    )


def _likeliest(cofactors: Floats, residuals: Floats) -> tuple[float, float]:
    """Return the likeliest factor F of the standard deviations of residuals, and the gain of log L.

    Along the eigenvectors of their cofactors R, with eigenvalues mu, residuals have the variances mu + (F^2 -
    1) mu^2.
    """
    mu, vectors = np.linalg.eigh((cofactors + cofactors.T) / 2)
    seen = mu > VISIBLE
    squares = (vectors.T[seen] @ residuals) ** 2 / mu[seen]
    factors = np.geomspace(1.0, LARGEST_FACTOR, FACTORS)
    growth = 1.0 + np.multiply.outer(factors**2 - 1.0, mu[seen])
    gains = (squares * (1.0 - 1.0 / growth) - np.log(growth)).sum(axis=1) / 2
    best = int(gains.argmax())
    return float(factors[best]), float(gains[best])
