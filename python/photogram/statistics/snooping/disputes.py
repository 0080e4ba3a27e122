"""Removals that other observations would explain as well: they are reinstated, and named with their odds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from photogram.statistics.snooping.choosing import beyond
from photogram.statistics.snooping.conditioning import Chosen
from photogram.statistics.snooping.log import Removal, Rival
from photogram.statistics.snooping.suspects import LostSupportError, Tests
from photogram.statistics.snooping.taking_out import NEEDED, TakingOut
from photogram.words import Phrase, phrase

ODDS = 20.0  # Largest likelihood ratio of alternatives


def without_disputed(
    work: TakingOut, removed: list[int], choices: Sequence[Chosen], before: Tests
) -> list[int]:
    """Reinstate removed groups that have alternatives, and return the others.

    Images are excepted: only their own point depends on the choice. `choices` are those of the round, and
    `before` the tests before it.
    """
    single = [place for place in removed if _is_alone(work, place)]
    rivals_of = {choice.group: choice.rivals for choice in choices}
    disputed = {}
    for place in single:
        group = work.log[place].group
        if work.trial.whole:
            rivals = [rival for rival in rivals_of.get(group, ()) if rival[3] < ODDS]
        else:
            # Only one removal: others would change the test values as well.
            rivals = _fallen(work, group, before) if len(single) == 1 else []
        rivals = [rival for rival in rivals if rival[0] not in work.images]
        if rivals:
            disputed[place] = rivals
    return _reinstated(work, removed, disputed) if disputed else removed


def _fallen(work: TakingOut, group: int, before: Tests) -> list[tuple[int, float, int, float]]:
    """Return groups with the test value of a removed one that are not significant without it."""
    suspects, limit = work.suspects, work.level.limit(0)
    was, remains = (beyond(tests, work.unit(), work.scales, limit) for tests in (before, work.tests))
    candidates = (suspects.kinds != 0) & suspects.removable & was & ~remains & work.tests.active
    candidates[[entry.group for entry in work.log if entry.is_out]] = False
    change = (before.statistic[group] - before.statistic) / work.scales[group] / 2
    near = np.flatnonzero(candidates & (np.abs(change) < math.log(ODDS)))
    return [
        (other, float(before.statistic[other]), int(before.rank[other]), math.exp(change[other]))
        for other in near.tolist()
    ]


def _is_alone(work: TakingOut, place: int) -> bool:
    entry = work.log[place]
    return bool(entry.rows) and entry.group not in work.images and not entry.consequences


def _reinstated(
    work: TakingOut, removed: list[int], disputed: dict[int, list[tuple[int, float, int, float]]]
) -> list[int]:
    out = work.out.copy()
    for place in disputed:
        out.rows[list(work.log[place].rows)] = False
    try:
        work.adjust(out)
    except LostSupportError:
        return removed
    for place, rivals in disputed.items():
        entry = work.log[place]
        named = [Rival(str(work.suspects.name(group)), t, rank, odds) for group, t, rank, odds in rivals]
        work.kept.update([entry.group, *(rival[0] for rival in rivals)])
        work.log[place] = replace(entry, rivals=tuple(named), kept=DISPUTED)
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
