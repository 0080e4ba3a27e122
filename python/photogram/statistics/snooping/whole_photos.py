"""Photos that go as a whole: those of another exposure, or with scrambled names."""

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
"""Images of a photo that are out, by number and share, from which on the whole photo goes."""
EVEN = 0.25
"""Share of the largest test value of a photo that the median of all of them has where all its images are
bad: a few huge errors, such as exchanged names, lift the others, but far less."""
BAD_PHOTOS = 5  # Largest number of photos that are removed before tests of images


def take_bad_photos_out(work: TakingOut) -> None:
    """Take out as one group each photo whose images all disagree: those of another exposure, wrong names.

    Such a photo spoils all around it, so that nothing can be told of single images. The median of its
    test values stands out: a few gross errors do not move it. Where that is by its observed station, the
    photo stays, and the station is left to its own test.
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
    """Take out as a whole the photos most of whose images are out, each by itself."""
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
    """Take a photo out with all that was observed of it; return the place of its entry in the log."""
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
    """Put a photo out with all that was observed of it; return what else leaves with it."""
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
    """Enter a photo that is out, with what has fallen since then; return its place in the log.

    `before` is None if the network has never been adjusted with it.
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
    """Return the largest test value of the images of a photo, in standard deviations."""
    own = work.suspects.on_photo(photo)
    own = own[(work.suspects.kinds[own] == 0) & work.testable()[own]]
    return float(np.sqrt(work.tests.statistic[own] / work.tests.rank[own]).max(initial=0.0))


def _middles(work: TakingOut) -> Floats:
    """Return the median of the test values of the images of each photo, in standard deviations."""
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
    """Whether the images of a photo agree as soon as its observed position and attitude are out."""
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
