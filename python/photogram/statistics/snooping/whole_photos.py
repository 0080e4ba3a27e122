"""Removal of whole photos: photos of another exposure, or with scrambled names."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.statistics.distributions import log_chi_square
from photogram.statistics.snooping.log import Removal
from photogram.statistics.snooping.suspects import LostSupportError, Out, Standing
from photogram.statistics.snooping.taking_out import TakingOut
from photogram.words import Phrase, phrase

FAR = 5.0
LEAST_OF_PHOTO, MOST_OF_PHOTO = 4, 0.5
"""Least number and share of removed observations above which the whole photo is removed."""
EVEN = 0.25
"""Ratio of the median and the largest test value of a photo if all its observations are wrong.

A few huge errors, such as exchanged names, increase the other values, but far less."""
BAD_PHOTOS = 5  # Largest number of photos that are removed before tests of observations


def take_bad_photos_out(work: TakingOut) -> None:
    """Remove photos with disagreeing observations: wrong exposure or names.

    Such a photo affects all around it, so that single observations cannot be tested. The median of its test
    values is conspicuous, and a few gross errors do not change it. If an observed station causes it, the
    photo is retained, and the station is tested separately.
    """
    for _ in range(BAD_PHOTOS):
        middles = _middles(work)
        if not len(middles) or np.isnan(middles).all():
            return
        worst, usual = int(np.nanargmax(middles)), float(np.nanmedian(middles))
        single = middles[worst] < EVEN * _largest(work, worst)
        if (
            single
            or not middles[worst] > FAR * max(usual, 1.0)
            or _is_by_station(work, worst, middles[worst])
        ):
            return
        if _photo_out(work, worst, 0, phrase("snooping.median", median=middles[worst], usual=usual)) is None:
            return


def take_photos_out(work: TakingOut, number: int) -> list[int]:
    """Remove the photos most of whose observations are removed, each separately."""
    suspects = work.suspects
    single = [work.log[place] for place in range(len(work.log)) if work.log[place].is_out]
    photos = [int(suspects.photos[each.group]) for each in single if each.group in work.images]
    counts = np.bincount([photo for photo in photos if photo >= 0])
    added = []
    for photo in np.flatnonzero(counts >= LEAST_OF_PHOTO).tolist():
        images = sum(group in work.images for group in suspects.on_photo(photo).tolist())
        if photo in work.out.photos or counts[photo] <= MOST_OF_PHOTO * images:
            continue
        reason = phrase("snooping.singly", removed=int(counts[photo]), images=images)
        place = _photo_out(work, photo, number, reason)
        added += [] if place is None else [place]
    return added


def _photo_out(work: TakingOut, photo: int, number: int, reason: Phrase) -> int | None:
    """Remove a photo with all its observations; return the number of its log entry."""
    before = work.standing
    out = work.out.copy()
    consequences = take_photo(work, out, photo)
    try:
        work.adjust(out)
    except LostSupportError:
        work.adjust(work.out)
        return None
    return log_photo(work, photo, number, before, (reason, *consequences))


def take_photo(work: TakingOut, out: Out, photo: int) -> list[Phrase]:
    """Exclude a photo with all observations; return dependent exclusions."""
    suspects = work.suspects
    own = suspects.on_photo(photo)
    out.rows[np.concatenate([suspects.rows(group) for group in own.tolist()])] = True
    out.photos.add(photo)
    consequences: list[Phrase] = []
    for group in own.tolist():
        if group not in work.images:
            continue
        for point in sorted(work.trial.consequences(out, group)[0] - out.points):
            out.points.add(point)
            consequences += work.left(out, point)
    return consequences


def log_photo(
    work: TakingOut, photo: int, number: int, before: Standing | None, consequences: tuple[Phrase | str, ...]
) -> int:
    """Log the removal of a photo with its decrease of Omega; return the entry.

    `before` is None if the network was never adjusted with the photo.
    """
    suspects = work.suspects
    omega, log_p = math.nan, math.nan
    freedom = sum(len(suspects.rows(group)) for group in suspects.on_photo(photo).tolist())
    if before is not None:
        omega = before.weighted_sum_of_squares - work.standing.weighted_sum_of_squares
        freedom = before.degrees_of_freedom - work.standing.degrees_of_freedom
        log_p = float(log_chi_square(max(omega, 0.0), max(freedom, 1)))
    work.log.append(
        Removal(
            round=number,
            group=next(group for group in suspects.on_photo(photo).tolist() if group in work.images),
            kind="photo",
            subject=Phrase("named.whole", suspects.photo_name(photo).fields),
            rows=(),
            components=(),
            units=(),
            dimension=freedom,
            first_statistic=omega,
            statistic=omega,
            fisher=math.nan,
            log_probability=log_p,
            limit=work.level.limit(0),
            error=(),
            error_sd=(),
            redundancy=math.nan,
            consequences=consequences,
        )
    )
    return len(work.log) - 1


def _largest(work: TakingOut, photo: int) -> float:
    """Return the largest test value of a photo's observations, in sd."""
    own = work.suspects.on_photo(photo)
    own = own[(work.suspects.kinds[own] == 0) & work.testable()[own]]
    return float(np.sqrt(work.tests.statistic[own] / work.tests.rank[own]).max(initial=0.0))


def _middles(work: TakingOut) -> Floats:
    """Return median test values of observations of photos, in sd."""
    suspects, tests = work.suspects, work.tests
    tested = (suspects.kinds == 0) & work.testable()
    size = np.sqrt(tests.statistic / np.maximum(tests.rank, 1))
    photos = int(suspects.photos.max(initial=-1)) + 1
    found: Floats = np.full(photos, math.nan)
    for photo in range(photos):
        own = suspects.on_photo(photo)
        own = own[tested[own]]
        if own.size >= LEAST_OF_PHOTO:
            found[photo] = float(np.median(size[own]))
    return found


def _is_by_station(work: TakingOut, photo: int, middle: float) -> bool:
    """Whether a photo's observations agree without its observed pose."""
    own = work.suspects.on_photo(photo)
    stations = own[(work.suspects.kinds[own] != 0) & work.tests.active[own]]
    if not stations.size:
        return False
    out, before = work.out.copy(), work.out
    for group in stations.tolist():
        out.rows[work.suspects.rows(group)] = True
    try:
        work.adjust(out)
        left = _middles(work)[photo]
        work.adjust(before)
    except LostSupportError:
        return False
    return bool(left < middle / FAR)
