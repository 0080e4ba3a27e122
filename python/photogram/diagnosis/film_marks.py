"""Misfitting fiducial marks of all photos, a photo, or a reading, with the cause.

Films that have changed along one axis but are modelled as conformal leave a pattern at the marks. If
residuals are too large, the block is adjusted with free b1 and b2 of these films. Along the axis at
atan2(b2, b1)/2 a film is longer by 2 sqrt(b1^2 + b2^2) than across.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from photogram.diagnosis.mistakes import MOST, Adjuster, omega
from photogram.diagnosis.tested_values import FOUND
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.films import Film, Mark
from photogram.network.observations import Fiducial, KnownTogether
from photogram.results.fixed_tests import is_suspected
from photogram.results.result import Result
from photogram.statistics.distributions import critical_chi_square
from photogram.statistics.limits import normal_limit
from photogram.words import Phrase, phrase

CERTIFICATE = "certificate"
ALIKE = 0.7  # Comparable test values, as a part of the largest
FEWEST_FAILING = 3  # Marks of a photo that all fail


class _Tested(NamedTuple):
    """The largest test value of a reading, or of a mark in its certificate (without photo)."""

    value: float
    mark: str
    photo: str = ""

    @property
    def message(self) -> Phrase:
        return phrase("film-check.marks.reading", mark=self.mark, photo=self.photo, test=self.value)


def mark_hints(result: Result) -> list[Message]:
    """Return the probable mistake in fiducial marks.

    If a mark fails on all photos, its certificate is wrong. If all marks of a photo fail, their names, the
    side of the film or the camera are wrong. A single reading may refer to a wrong location. The largest test
    value decides.
    """
    tested = sorted(_tested(result), key=lambda each: -each.value)
    limit = normal_limit(2 * len(tested), FOUND)
    if not tested or not tested[0].value > limit:
        return []
    largest, readings = tested[0], [each for each in tested if each.photo]
    whole = _photos(readings, limit)
    if largest.photo in whole:
        return [Message(phrase("film-check.marks.all", photos=whole))]
    worst = [each for each in tested if each.value >= max(limit, ALIKE * largest.value)]
    if largest.photo:
        messages = [each.message for each in worst if each.photo]
        return [Message(phrase("film-check.marks.readings", readings=messages))]
    counts = Counter(each.mark for each in readings)
    named = [
        phrase("film-check.marks.mark", mark=each.mark, test=each.value, n=counts[each.mark])
        for each in worst
        if not each.photo
    ]
    several = len(named) >= FEWEST_FAILING and all(film.pattern is None for _, film in result.films)
    return [Message(phrase(f"film-check.marks.{'pattern' if several else 'certificate'}", marks=named))]


def _photos(readings: list[_Tested], limit: float) -> list[str]:
    """Return the worst photos on which at least three marks, and more than half, fail."""
    found = defaultdict[str, list[float]](list)
    for each in readings:
        found[each.photo].append(each.value)
    size = {photo: float(np.sqrt(np.mean(np.square(values)))) for photo, values in found.items()}
    return [
        photo
        for photo, values in found.items()
        if sum(each > limit for each in values) >= max(FEWEST_FAILING, len(values) / 2 + 0.5)
        and size[photo] >= ALIKE * max(size.values())
    ]


def _tested(result: Result) -> Iterator[_Tested]:
    for kind in (result.kinds[name] for name in (Fiducial.KIND, CERTIFICATE) if name in result.kinds):
        sizes = np.abs(np.nan_to_num(kind.standardized))
        for row, values in zip(kind.rows.tolist(), sizes, strict=True):
            own = result.block.observations[row]
            if not isinstance(own, KnownTogether):
                photo, mark = own.of
                yield _Tested(float(values.max()), mark, photo)
            elif all(isinstance(each, Mark) for each in own.joined):
                pairs = values.reshape(-1, 2).max(axis=1).tolist()
                yield from (_Tested(value, each.name) for value, each in zip(pairs, own.joined, strict=True))


FEWEST = 4  # Marks of a photo: three fit any axis
CHANCE = 1e-3  # Probability of a hint in correct data


def axis_hints(result: Result) -> list[Message]:
    """Report photos with unmodelled film changes along one axis."""
    read = result.block.observations.of_type(Fiducial)
    count = Counter(each.photo for each in read)
    names = result.block.photo_ids
    conformal = {
        row: film
        for row, film in result.films
        if not (film.placement.is_held or film.size.deviations[1:].any()) and count[names[row]] >= FEWEST
    }
    if not conformal or not is_suspected(result):
        return []
    meant = Adjuster.of(result).converged(_freed(result.block, conformal))
    squares, freedom = result.sum_and_freedom
    if meant is None or omega(result) - omega(meant) < MOST * (squares - freedom):
        return []
    limit, found = critical_chi_square(CHANCE / len(conformal), 2), []
    for row in conformal:
        b = meant.film[row, 4:]
        if b @ np.linalg.solve(meant.film_cofactors[row, 4:, 4:], b) > limit:
            found.append((2.0 * float(np.hypot(*b)), names[row], np.degrees(np.arctan2(b[1], b[0]) / 2)))
    if not found:
        return []
    found.sort(reverse=True)
    longer, photo, angle = found[0]
    far = max(float(np.linalg.norm(each.mark.position[:2])) for each in read if each.photo == photo)
    fields = {"longer": longer, "angle": float(angle), "at_marks": 1e3 * longer * far}
    return [Message(phrase("film-check.axis", photos=[name for _, name, _ in found], photo=photo, **fields))]


def _freed(block: Block, films: Mapping[int, Film]) -> Block:
    """Return a block with free b1 and b2 of some films."""
    meant: dict[int, object] = {}
    for film in films.values():
        size = film.size.replace(sd=[film.size.deviations[0], np.inf, np.inf])
        meant |= {id(film.size): size, id(film): replace(film, size=size)}

    def freed(item: Any) -> Any:
        changes = {name: meant[id(own)] for name, own in vars(item).items() if id(own) in meant}
        return replace(item, **changes) if changes else item

    observations, passages = ([*map(freed, own)] for own in (block.observations, block.passages))
    return block.replace(observations=observations, passages=passages)
