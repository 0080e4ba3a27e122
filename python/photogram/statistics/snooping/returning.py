"""What is out, tested against what the rest predicts of it: what agrees comes back."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.statistics.distributions import log_chi_square, log_fisher
from photogram.statistics.snooping.log import Removal
from photogram.statistics.snooping.suspects import LostSupportError
from photogram.statistics.snooping.taking_out import TakingOut

__all__ = ["agreeing", "log_probability", "note_return", "take_back", "with_prediction"]


def note_return(work: TakingOut, places: list[int], number: int) -> None:
    """Say in the log that entries, by their places there, have come back in a round."""
    for place in places:
        work.returns.add(work.log[place].group)
        work.log[place] = with_prediction(work, place).with_(returned=number)


def take_back(work: TakingOut, number: int) -> list[int]:
    """Take back what agrees with the rest, one adjustment after the other."""
    returning = agreeing(work)
    if not returning:
        return []
    out = work.out.copy()
    for place in returning:
        out.rows[list(work.log[place].rows)] = False
    try:
        work.adjust(out)
    except LostSupportError:
        return []
    note_return(work, returning, number)
    return returning + take_back(work, number)


def agreeing(work: TakingOut) -> list[int]:
    """Test what is out against the rest, and return what agrees: the best, or all that are apart."""
    places = [place for place, each in enumerate(work.log) if each.is_out and each.rows]
    if not places:
        return []
    predictions = work.trial.predictions([work.log[place].group for place in places])
    known = [(place, own) for place, own in zip(places, predictions, strict=True) if own is not None]
    log_p = log_probability(
        work,
        np.array([own.statistic for _, own in known]),
        np.array([len(own.rows) for _, own in known]),
        np.array([work.log[place].group for place, _ in known], dtype=np.int64),
    ).tolist()
    work.predicted = {place: (own, value) for (place, own), value in zip(known, log_p, strict=True)}
    limit = math.log(work.level.limit(0))
    agreeing = sorted(
        (-value, place)
        for place, (_, value) in work.predicted.items()
        if value >= limit and work.log[place].group not in work.returns
    )
    return _apart(work, [place for _, place in agreeing])


def _apart(work: TakingOut, places: list[int]) -> list[int]:
    """Return the first where every one is tested alone, else those that have no photo in common."""
    if work.trial.whole:
        return places[:1]
    taken: set[int] = set()
    apart = []
    for place in places:
        group = work.log[place].group
        photo = int(work.suspects.photos[group])
        photos = {photo} if photo >= 0 else set(work.suspects.loads(group).tolist())
        if not photos & taken:
            taken |= photos
            apart.append(place)
    return apart


def with_prediction(work: TakingOut, place: int) -> Removal:
    """Return an entry of the log with what the rest says of it."""
    if place not in work.predicted:
        return work.log[place]
    prediction, log_p = work.predicted[place]
    # Another entry may have taken out other components of the same group.
    errors = dict(zip(prediction.rows, prediction.error, strict=True))
    return work.log[place].with_(
        prediction=prediction.statistic,
        prediction_log_probability=log_p,
        prediction_error=tuple(errors.get(row, math.nan) for row in work.log[place].rows),
    )


def log_probability(work: TakingOut, statistic: Floats, dimension: Indices, groups: Indices) -> Floats:
    """Return log-probabilities of what is out as observations of the network without it."""
    if work.settings.known:
        return log_chi_square(statistic / work.scales[groups], dimension)
    f = work.standing.degrees_of_freedom
    if not (f > 0 and work.standing.weighted_sum_of_squares > 0):
        return np.zeros(len(statistic))
    s2 = work.standing.weighted_sum_of_squares / f
    return log_fisher(statistic / dimension / s2, dimension, f)
