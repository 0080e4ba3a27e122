"""Rules of verdicts on standard deviations: all too small or too large, or those of a type."""

from __future__ import annotations

import math
from collections.abc import Iterable

from photogram.statistics.evidence import Evidence
from photogram.statistics.findings import ALTERNATIVES, TypeFactor
from photogram.statistics.limits import NOTABLE_FACTOR
from photogram.words import Phrase

WRONG_ALIKE = 1.5
"""Limit of the median factor, and of the ratio of the mean-square and the median factor.

If the median factor is larger and the ratio smaller, all residuals are too large, not a few."""

LARGEST_FACTOR = 3.0  # Largest factor of standard deviations that weights explain


def intersected(e: Evidence) -> Phrase | None:
    if not e.high or e.gross or not e.found.intersected:
        return None
    return Phrase("verdict.intersection", {"factor": e.interval()})


def common_factor(far: bool, e: Evidence) -> Phrase | None:
    """Return an implausible common factor of sd (`far`), or a smaller one."""
    if not e.high or e.gross or e.pattern or e.found.intersected or is_far(e) is not far:
        return None
    if "weights-of-types" in e.codes:
        return None
    if any(each.significant for each in e.found.components):
        return None
    if e.robust is not None and e.robust < e.factor / NOTABLE_FACTOR:
        return None
    scaled = ".scaled" if e.found.scaled and not far else ""
    return Phrase(f"verdict.weights{scaled}", {"factor": e.interval()})


def are_alike(e: Evidence) -> bool:
    """Whether the standard deviations of all residuals are too small, not a few residuals too large."""
    return e.robust is not None and e.robust > WRONG_ALIKE and e.factor <= WRONG_ALIKE * e.robust


def wrong_type(e: Evidence) -> Phrase | None:
    """Return types whose standard deviations, too small, explain more than errors of values."""
    if e.pattern:
        return None
    # Log odds of errors of values that tests do not detect say nothing.
    only = not e.single and not e.found.common
    wrong = [each for each in e.found.types if each.is_rejected] if only else []
    wrong = wrong or wrong_types(e.found.types, e.found.odds)
    wrong = [each for each in wrong if not each.factor < WRONG_ALIKE * e.factor]
    return Phrase("verdict.weights-of-types.alone", {"types": list(map(needed, wrong))}) if wrong else None


def wrong_types(types: Iterable[TypeFactor], odds: float) -> list[TypeFactor]:
    """Return types whose factor has larger log odds than errors of values."""
    return [each for each in types if each.log_odds > odds + math.log(ALTERNATIVES)]


def needed(each: TypeFactor) -> Phrase:
    fields = {"kind": each.group, "factor": each.factor}
    sd = {} if math.isnan(each.sd) else {"sd": each.sd * each.factor, "unit": each.unit}
    return Phrase(f"part.type{'.sd' if sd else ''}", fields | sd)


def types_with_common_factor(e: Evidence) -> Phrase | None:
    """Return the types that a common factor of all standard deviations makes wrong.

    The factor of all residuals, which scales the covariances, is that of the types with most redundancy.
    """
    f = e.factor
    if not e.found.scaled or e.gross or e.pattern or e.found.intersected or not (e.high or e.low):
        return None
    if (
        "weights-of-types" in e.codes
        or 1 / WRONG_ALIKE <= f <= WRONG_ALIKE
        or (e.high and e.robust is not None and e.robust < f / NOTABLE_FACTOR)
    ):
        return None
    causes, others = [], []
    for each in e.found.types:
        if each.opposes(f):
            others.append(each.group)
        elif each.redundancy >= 1.0:
            causes.append(needed(each))
    return (
        Phrase("verdict.weights-of-types", {"types": causes, "others": others}) if others and causes else None
    )


def is_far(e: Evidence) -> bool:
    return e.factor > LARGEST_FACTOR


def components(e: Evidence) -> Phrase | None:
    groups = [
        Phrase(
            "part.group",
            {"group": each.group, "factor": each.factor, "low": each.interval[0], "high": each.interval[1]},
        )
        for each in e.found.components
        if each.significant
    ]
    return Phrase("verdict.weights-of-groups", {"groups": groups}) if groups else None


def has_far_groups(e: Evidence) -> bool:
    return any(
        each.significant and not 1 / LARGEST_FACTOR <= each.factor <= LARGEST_FACTOR
        for each in e.found.components
    )


def too_low(e: Evidence) -> Phrase | None:
    if not e.low or "weights-of-types" in e.codes:
        return None
    return Phrase("verdict.weights-pessimistic", {"factor": 1 / e.factor})
