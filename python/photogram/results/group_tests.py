"""The groups of observations of a network as the verdict tests them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from photogram.results.network_trial import KINDS, OBSERVATION
from photogram.results.reliability_summary import ReliabilitySummary
from photogram.statistics.findings import Tested, by_f

__all__ = ["groups_tested"]

PLURALS = {
    "image": "images",
    "control": "control points",
    "position": "positions of photos",
    "attitude": "attitudes of photos",
    "camera": "cameras",
    "unknown": "common unknowns",
}
"""What the kinds are called; those of observations beside images have labels."""


def groups_tested(
    summary: ReliabilitySummary, labels: Sequence[str] = (), unit_weight: tuple[float, float] | None = None
) -> list[Tested]:
    """Return the tests of all groups, kind by kind.

    Parameters
    ----------
    summary
        With the tests.
    labels
        Of the observations beside images, in the order of the core.
    unit_weight
        The weighted sum of squares and the degrees of freedom where the unit weight is estimated; None where
        it is known.
    """
    suspects, tests = summary.suspects, summary.tests
    testable = summary.testable
    found = []
    for kind, name in enumerate(KINDS):
        own = np.flatnonzero(suspects.kinds == kind)
        parts = [(PLURALS.get(name, name), own)]
        if kind == OBSERVATION:
            named = np.array(labels, dtype=object)[suspects.subjects[own]]
            parts = [(f"observations of the kind {each}", own[named == each]) for each in sorted(set(labels))]
        for what, groups in parts:
            if not testable[groups].any():
                continue
            values = np.where(testable[groups], tests.statistic[groups], math.nan)
            tested = Tested(what, values, _names(summary, groups), "T", tests.rank[groups].astype(np.float64))
            found.append(tested if unit_weight is None else by_f(tested, *unit_weight))
    return found


def _names(summary: ReliabilitySummary, groups: np.ndarray) -> Callable[[tuple[int, ...]], str]:
    return lambda place: summary.suspects.name(int(groups[place[0]]))
