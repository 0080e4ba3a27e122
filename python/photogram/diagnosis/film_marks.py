"""Fiducial marks that do not fit: of all photos, of one photo, or one reading; what to look at first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from photogram.diagnosis.robust import critical
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message, counted, listed
from photogram.network.films import Mark
from photogram.network.observations import Fiducial, KnownTogether
from photogram.results.observation_kinds import ObservedKind
from photogram.results.result import Result

__all__ = ["mark_hints"]

CERTIFICATE = "certificate"
ALIKE = 0.7
"""What has at least this part of the largest test value is named beside it: less may be its consequence."""
FEWEST = 3
"""Marks of a photo that all fail."""


@dataclass(frozen=True)
class _Tested:
    """The largest test value of a reading, or of a mark in its certificate."""

    value: float
    mark: str
    photo: str = ""


def mark_hints(result: Result) -> list[Message]:
    """Say where marks fail what is to be looked at first.

    A mark that fails on all photos is wrong in the certificate; all marks of a photo are named wrongly, seen
    from the other side, or of another camera; a single reading is of the wrong place. The largest test value
    tells: what is wrong pulls at the rest.
    """
    readings, marks = list(_readings(result)), list(_marks(result))
    tested = [*readings, *marks]
    largest = max((each.value for each in tested), default=0.0)
    limit = critical(2 * len(tested))
    if not largest > limit:
        return []
    whole = _photos(readings, limit)
    if any(each.value == largest and each.photo in whole for each in readings):
        return [
            Message(
                f"nearly all fiducials of {listed(whole, 5)} fail their tests: are they named as they lie, is"
                " the film seen from the side that is given, is the camera another?"
            )
        ]
    limit = max(limit, ALIKE * largest)
    order = sorted((each for each in tested if each.value >= limit), key=lambda each: -each.value)
    if order[0].photo:
        named = [f"{each.mark} on {each.photo} (w = {each.value:.1f})" for each in order if each.photo]
        return [Message(f"{listed(named, 5)}: measured on the wrong place, or another mark?")]
    named = [
        f"{each.mark} (w = {each.value:.1f}, on {counted(_shown(readings, each.mark), 'photo')})"
        for each in order
        if not each.photo
    ]
    several = len(named) >= FEWEST and all(film.pattern is None for _, film in result.films)
    pattern = ", or films have a pattern that was left out (`pattern` of the table films)" if several else ""
    return [
        Message(
            f"{listed(named, 5)}: where it fails on all photos its place in the certificate is wrong{pattern}"
        )
    ]


def _photos(readings: list[_Tested], limit: float) -> list[str]:
    """Return the photos of whose marks more than half fail, three at least, and that are worst in all."""
    found: dict[str, list[float]] = {}
    for each in readings:
        found.setdefault(each.photo, []).append(each.value)
    size = {photo: float(np.sqrt(np.mean(np.square(values)))) for photo, values in found.items()}
    worst = ALIKE * max(size.values(), default=0.0)
    return [
        photo
        for photo, values in found.items()
        if sum(each > limit for each in values) >= max(FEWEST, len(values) / 2 + 0.5) and size[photo] >= worst
    ]


def _shown(readings: list[_Tested], mark: str) -> int:
    return sum(each.mark == mark for each in readings)


def _readings(result: Result) -> Iterator[_Tested]:
    kind = result.kinds.get(Fiducial.KIND)
    for row, values in _rows(kind):
        photo, mark = result.block.observations[row].of
        yield _Tested(float(values.max()), mark, photo)


def _marks(result: Result) -> Iterator[_Tested]:
    for row, values in _rows(result.kinds.get(CERTIFICATE)):
        own = result.block.observations[row]
        assert isinstance(own, KnownTogether)
        if all(isinstance(each, Mark) for each in own.joined):
            pairs = values.reshape(-1, 2).max(axis=1).tolist()
            yield from (_Tested(value, each.name) for value, each in zip(pairs, own.joined, strict=True))


def _rows(kind: ObservedKind | None) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the number of each observation of a kind, and how large its test values are."""
    if kind is not None:
        yield from zip(kind.rows.tolist(), np.abs(np.nan_to_num(kind.standardized)), strict=True)
