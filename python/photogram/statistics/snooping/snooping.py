"""The rounds of data snooping: select, remove, adjust, test again."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from photogram.lazy_dataclasses import dataclass
from photogram.statistics.limits import global_test
from photogram.statistics.snooping.disputes import without_disputed
from photogram.statistics.snooping.log import Removal, Round
from photogram.statistics.snooping.starts import begun, needs_robust_start, scales, start_robustly
from photogram.statistics.snooping.suspects import Aside, Out, Standing, Tests, Trial
from photogram.statistics.snooping.taking_out import (
    Settings,
    TakingOut,
    agreeing,
    note_return,
    take_back,
    with_prediction,
)
from photogram.statistics.snooping.whole_photos import take_bad_photos_out, take_photos_out
from photogram.words import Phrase, phrase


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of data snooping."""

    log: list[Removal]  # all removals in order
    rounds: list[Round]  # the last one is without removals
    out: Out  # excluded observations
    tests: int  # number of tested groups, as at the start
    before: Standing  # with all observations, and without the excluded ones
    standing: Standing
    # Robust factors of standard deviations by type; empty if the given ones are used
    factors: dict[str, float]
    final: Tests  # tests at the end
    remarks: list[Phrase]


def snooped(
    trial: Trial,
    settings: Settings,
    afresh: Callable[[], Aside | None] | None = None,
    common: Callable[[Tests, Standing], Sequence[Phrase]] | None = None,
) -> Outcome:
    """Remove gross errors from a network and return the outcome.

    Parameters
    ----------
    trial
        The network.
    settings
        Settings of data snooping.
    afresh
        Restarts the trial from a consensus of its observations if its adjustment diverges. Returns the
        observations that the consensus rejects; None without consensus.
    common
        Returns common errors of sets that explain the test values better than errors of single observations.
        Then nothing is removed: removing the members one after the other would hide the cause.
    """
    work = begun(trial, settings, afresh)
    errors: Sequence[Phrase] = []
    if common is not None and not work.log and is_rejected(work):
        work.adjust(work.out, exact=True)
        errors = common(work.tests, work.standing)
    if errors:
        work.remarks.append(phrase("snooping.common", errors=list(errors)))
    else:
        _remove(work)
    out = [place for place, each in enumerate(work.log) if each.is_out]
    for place in out:
        work.log[place] = with_prediction(work, place)
    return Outcome(
        log=work.log,
        rounds=work.rounds,
        out=work.out,
        tests=work.level.tests,
        before=work.before,
        standing=work.standing,
        factors=work.factors,
        final=work.tests,
        remarks=work.remarks,
    )


def is_rejected(work: TakingOut) -> bool:
    """Whether residuals of a converged adjustment are too large."""
    standing = work.standing
    test = global_test(*standing.sum_and_freedom)
    return standing.status == "converged" and test is not None and test.rejected_high


def _remove(work: TakingOut) -> None:
    take_bad_photos_out(work)
    if needs_robust_start(work):
        start_robustly(work)
    else:
        work.factors, work.scales = scales(work)
    for number in range(1, work.settings.max_rounds + 1):
        removed, returned = _round(work, number)
        if not removed and not returned:
            break
    else:
        work.remarks.append(phrase("snooping.not-ended", n=work.settings.max_rounds))


def _round(work: TakingOut, number: int) -> tuple[list[int], list[int]]:
    standing, before = work.standing, work.tests
    count = sum(each.is_out for each in work.log)
    choices = work.choosing(work.allowed(), count, ahead=True).choose()
    # In a large network, earlier removals are reinstated in the adjustment that removes others.
    returned = [] if work.trial.whole else agreeing(work)
    removed = work.apply(work.entries(choices, number), returned)
    note_return(work, returned, number)
    removed = without_disputed(work, removed, choices, before)
    if work.trial.whole:
        returned = take_back(work, number)
    removed += take_photos_out(work, number)
    work.note_round(number, standing, removed, returned, out=count)
    return removed, returned
