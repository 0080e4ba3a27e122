"""Evaluation of the reliability of an adjusted network: hypotheses, standard deviations by type, summary."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import finite_rows
from photogram.results.hypotheses import DETECTION, Hypotheses
from photogram.results.hypothesis_tests import hypotheses
from photogram.results.network import AdjustedNetwork
from photogram.results.network_trial import Facts, LostSupportError, Out
from photogram.results.reliability import Reliability, downweighted
from photogram.results.reliability_summary import ReliabilitySummary, listed
from photogram.results.type_factors import type_factors
from photogram.statistics.findings import TypeFactor
from photogram.statistics.weight_rules import wrong_types

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
