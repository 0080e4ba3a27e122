"""Removals that other observations would explain as well: they are reinstated, and named with their odds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from photogram.statistics.snooping.choosing import beyond
from photogram.statistics.snooping.log import Removal, Rival
from photogram.statistics.snooping.suspects import LostSupportError, Tests
from photogram.statistics.snooping.taking_out import NEEDED, TakingOut
from photogram.words import Phrase, phrase

ODDS = 20.0  # Largest likelihood ratio of alternatives


def without_disputed(work: TakingOut, removed: list[int], before: Tests) -> list[int]:
    """Reinstate removed groups that have alternatives, and return the others.

    Images are excepted: only their own point depends on the choice. An alternative of another observation was
    significant before the removal with a test value that is nearly as large, and is not significant after it.
    `before` are the tests before the removals.
    """
    single = [place for place in removed if _is_alone(work, place)]
    if not single:
        return removed
    suspects, limit = work.suspects, work.level.limit(0)
    was, remains = (beyond(tests, work.unit(), work.scales, limit) for tests in (before, work.tests))
    candidates = (suspects.kinds != 0) & suspects.removable & was & ~remains & work.tests.active
    candidates[[entry.group for entry in work.log if entry.is_out]] = False
    statistics = before.statistic / work.scales
    disputed = {}
    for place in single:
        group = work.log[place].group
        least = statistics[group] - 2 * math.log(ODDS)
        if rivals := np.flatnonzero(candidates & (statistics > least)).tolist():
            disputed[place] = rivals
    return _reinstated(work, removed, before, disputed) if disputed else removed


def _is_alone(work: TakingOut, place: int) -> bool:
    entry = work.log[place]
    return bool(entry.rows) and entry.group not in work.images and not entry.consequences


def _reinstated(
    work: TakingOut, removed: list[int], before: Tests, disputed: dict[int, list[int]]
) -> list[int]:
    out = work.out.copy()
    for place in disputed:
        out.rows[list(work.log[place].rows)] = False
    try:
        work.adjust(out)
    except LostSupportError:
        return removed
    for place, groups in disputed.items():
        entry = work.log[place]
        rivals = [
            Rival(
                str(work.suspects.name(group)),
                float(before.statistic[group]),
                int(before.rank[group]),
                math.exp(min(entry.first_statistic - before.statistic[group], 1e3) / 2),
            )
            for group in groups
        ]
        work.kept.update([entry.group, *groups])
        work.log[place] = replace(entry, rivals=tuple(rivals), kept=DISPUTED)
    return [place for place in removed if place not in disputed]


DISPUTED = Phrase("snooping.disputed")


def disputes(log: Sequence[Removal]) -> list[Phrase]:
    """Return the observations of the log that have alternatives, each with these and their odds.

    Observations other than images, none of which can be removed without losing the datum, are alternatives of
    each other.
    """
    found = [_alternatives(each, each.rivals) for each in log if each.kept == DISPUTED]
    needed = [each for each in log if each.kept == NEEDED and each.kind != "image"]
    needed.sort(key=lambda each: -each.statistic)
    if len(needed) > 1:
        first, *others = needed
        rivals = [
            Rival(
                each.name,
                each.statistic,
                each.dimension,
                math.exp(min(first.statistic - each.statistic, 1e3) / 2),
            )
            for each in others
        ]
        if near := [rival for rival in rivals if rival.odds < ODDS]:
            found.append(_alternatives(first, near))
    return found


def _alternatives(entry: Removal, rivals: Sequence[Rival]) -> Phrase:
    names = [phrase("snooping.rival", name=rival.name, odds=rival.odds) for rival in rivals]
    return phrase("snooping.rivals", groups=[entry.subject, *names])
