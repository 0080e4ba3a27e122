"""Calibrated distances compared with coordinates, and single corrections that explain differences.

Certificates were transcribed by hand, often twice. One transcription error is tested in a distance and its
four coordinates: neighbouring digits exchanged, the sign, one digit, one digit lost or added. No value is
changed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Literal, get_args

from photogram.lazy_dataclasses import dataclass, replace
from photogram.words import Phrase, phrase

How = Literal["exchange", "sign", "digit", "lost or extra"]

LIMIT = 0.010  # Largest difference of a distance from its coordinates, millimetres
EXPLAINED = 0.0035  # Largest remaining difference if a change explains it, millimetres
SAME = 1e-9  # Tolerance for equal differences, millimetres
_LEADING_ZERO = re.compile(r"[-+]?0\d")


@dataclass(frozen=True)
class Explanation:
    """Single correction of a transcribed value that explains a difference.

    Attributes
    ----------
    field
        Coordinate `ml.x`, or distance `ml-mr`.
    typed, perhaps
        The transcribed value, and the probable original value.
    how
        `exchange` of neighbouring digits, `sign`, `digit`, `lost or extra`.
    remaining
        Remaining difference, mm.
    from_usual
        The corrected coordinate minus the usual one of the mark, mm; None if that is unknown.
    """

    field: str
    typed: str
    perhaps: str
    how: How
    remaining: float
    from_usual: float | None = None

    def __str__(self) -> str:
        return str(phrase("films.change", **vars(self)))


@dataclass(frozen=True)
class DistanceDifference:
    """Calibrated distance and the distance computed from the coordinates of its marks.

    Attributes
    ----------
    name
        Name of the distance, such as `ml-mr`.
    distance, from_coordinates
        Both distances, mm.
    explanations
        Single corrections that explain a difference beyond 0.010 mm, most probable first.
    """

    name: str
    distance: float
    from_coordinates: float
    explanations: tuple[Explanation, ...] = ()

    @property
    def difference(self) -> float:
        """Calibrated minus computed distance, mm."""
        return self.distance - self.from_coordinates

    @property
    def beyond(self) -> bool:
        """Whether the difference is larger than 0.010 mm."""
        return abs(self.difference) > LIMIT

    def __str__(self) -> str:
        return str(difference_message(self))


def difference_message(difference: DistanceDifference) -> Phrase:
    """Return the message of a distance with its most probable explanations."""
    changes = [phrase("films.change", **vars(each)) for each in difference.explanations[:2]]
    others = len(difference.explanations) - 1
    fields = {"distance": difference.distance, "coordinates": difference.from_coordinates}
    code = "films.difference.several" if others > 1 else "films.difference"
    if len(changes) == 0 and difference.beyond:
        code = "films.difference.unexplained"
    elif changes and others < 2:
        code = "films.difference.two" if others else "films.difference.single"
    explained = dict(zip(("first", "second"), changes, strict=False))
    return phrase(code, name=difference.name, others=others, **fields, **explained)


def difference_of(
    first: str, second: str, typed: Mapping[str, str], usual: Mapping[str, tuple[float, float]]
) -> DistanceDifference:
    """Compare a distance with the coordinates of its marks, and find single corrections that reconcile them.

    `typed` contains all transcribed values by field, `usual` the usual coordinates of marks (mm), if known.
    Corrections are sorted by type of error, then by the largest distance of a mark from its usual
    coordinates. If these are unknown, the remaining difference is the second criterion.
    """
    name = f"{first}-{second}"
    fields = [*(f"{mark}.{axis}" for mark in (first, second) for axis in "xy"), name]
    found = DistanceDifference(name, float(typed[name]), _from_coordinates(fields, typed))
    if not found.beyond:
        return found
    places = {field: usual[field[:-2]]["xy".index(field[-1])] for field in fields[:4] if field[:-2] in usual}
    ranked: list[tuple[tuple[int, float, int, int], Explanation]] = []
    for order, field in enumerate(fields):
        for how, perhaps in _variants(typed[field]):
            changed = {**{each: typed[each] for each in fields}, field: perhaps}
            left = float(changed[name]) - _from_coordinates(fields, changed)
            if abs(left) < EXPLAINED:
                moved = float(perhaps) - places[field] if field in places else None
                far = max((abs(float(changed[each]) - places[each]) for each in places), default=0.0)
                rank = get_args(How).index(how), far, round(abs(left) / SAME), order
                ranked.append((rank, Explanation(field, typed[field], perhaps, how, left, moved)))
    return replace(found, explanations=tuple(each for _, each in sorted(ranked, key=lambda pair: pair[0])))


def _from_coordinates(fields: Sequence[str], typed: Mapping[str, str]) -> float:
    x1, y1, x2, y2 = (float(typed[field]) for field in fields[:4])
    return math.hypot(x2 - x1, y2 - y1)


def _variants(text: str) -> Iterator[tuple[How, str]]:
    """Yield the numbers that one transcription error produces, once per error type."""
    for how, variant in dict.fromkeys(_slips(text)):
        with suppress(ValueError):
            if float(variant) != float(text):
                yield how, variant


def _slips(text: str) -> Iterator[tuple[How, str]]:
    digits = [place for place, letter in enumerate(text) if letter.isdigit()]
    for place in digits:
        if place + 1 in digits:
            yield "exchange", text[:place] + text[place + 1] + text[place] + text[place + 2 :]
    yield "sign", text[1:] if text[0] in "+-" else f"-{text}"
    for place in digits:
        for digit in "0123456789":
            yield "digit", text[:place] + digit + text[place + 1 :]
    for place in digits:
        yield "lost or extra", text[:place] + text[place + 1 :]
        for digit in "0123456789":
            for added in (text[:place] + digit + text[place:], text[: place + 1] + digit + text[place + 1 :]):
                if not _LEADING_ZERO.match(added):
                    yield "lost or extra", added
