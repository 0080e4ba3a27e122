"""Calibrated distances and calibrated coordinates: differences, and single changes that explain them.

Certificates were typed by hand, often twice. All variants of a distance and its four coordinates by one
typing error are tested: neighbouring digits exchanged, the sign, one digit, one digit lost or added.
No figure is changed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, get_args

from photogram.lazy_dataclasses import dataclass, replace
from photogram.words import Phrase, phrase

How = Literal["exchange", "sign", "digit", "lost or extra"]

LIMIT = 0.010  # Largest difference of a distance from its coordinates, millimetres
EXPLAINED = 0.0035  # Largest remaining difference if a change explains it, millimetres
SAME = 1e-9  # Differences that are equal except for rounding, millimetres
_LEADING_ZERO = re.compile(r"[-+]?0\d")


@dataclass(frozen=True)
class Explanation:
    """One change of one typed figure that explains a difference.

    Attributes
    ----------
    field
        `ml.x`, or the distance, `ml-mr`.
    typed, perhaps
        The figure as it stands there, and as it was perhaps meant.
    how
        `exchange` of neighbouring digits, `sign`, `digit`, `lost or extra`.
    remaining
        What the difference then is, mm.
    from_usual
        The changed coordinate less that of the usual place of the mark, mm; None where that is not known.
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
    """A distance beside the coordinates of its marks.

    Attributes
    ----------
    name
        `ml-mr`.
    distance, from_coordinates
        Millimetres.
    explanations
        Single changes of a figure that explain a difference beyond 0.010 mm, the likeliest first.
    """

    name: str
    distance: float
    from_coordinates: float
    explanations: tuple[Explanation, ...] = ()

    @property
    def difference(self) -> float:
        """Distance less that from coordinates, mm."""
        return self.distance - self.from_coordinates

    @property
    def beyond(self) -> bool:
        """Whether it is larger than 0.010 mm."""
        return abs(self.difference) > LIMIT

    def __str__(self) -> str:
        return str(difference_message(self))


def difference_message(difference: DistanceDifference) -> Phrase:
    """Return the message of a distance: the likeliest change, and the second one or the number of others."""
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
    """Compare a distance with the coordinates of its marks; explain differences of more than 0.010 mm.

    `typed` are all figures as typed in the certificate, by their fields; `usual` the usual places of marks
    (mm), if they are known.
    """
    name = f"{first}-{second}"
    fields = [*(f"{mark}.{axis}" for mark in (first, second) for axis in "xy"), name]
    found = DistanceDifference(name, float(typed[name]), _from_coordinates(fields, typed))
    if not found.beyond:
        return found
    places = {field: usual[field[:-2]]["xy".index(field[-1])] for field in fields[:4] if field[:-2] in usual}
    return replace(found, explanations=explained(fields, {field: typed[field] for field in fields}, places))


def explained(
    fields: Sequence[str], typed: Mapping[str, str], places: Mapping[str, float]
) -> tuple[Explanation, ...]:
    """Return the single changes that bring a distance and four coordinates together.

    In the order of the kinds of slips and, among changes of a kind, by how far from its usual place the
    farthest of both marks then is; where these are not known, by what is left. Fields are x and y of the one
    and of the other mark, then the distance; `typed` the figures by these, `places` usual coordinates as far
    as they are known.
    """
    found: list[tuple[tuple[int, float, int, int], Explanation]] = []
    kinds = get_args(How)
    for order, field in enumerate(fields):
        for how, perhaps in _variants(typed[field]):
            changed = {**typed, field: perhaps}
            left = float(changed[fields[-1]]) - _from_coordinates(fields, changed)
            if abs(left) < EXPLAINED:
                usual = float(perhaps) - places[field] if field in places else None
                far = max((abs(float(changed[each]) - places[each]) for each in places), default=0.0)
                rank = kinds.index(how), far, round(abs(left) / SAME), order
                found.append((rank, Explanation(field, typed[field], perhaps, how, left, usual)))
    return tuple(each for _, each in sorted(found, key=lambda pair: pair[0]))


def _from_coordinates(fields: Sequence[str], typed: Mapping[str, str]) -> float:
    x1, y1, x2, y2 = (float(typed[field]) for field in fields[:4])
    return math.hypot(x2 - x1, y2 - y1)


def _variants(text: str) -> Iterator[tuple[How, str]]:
    """Yield the other numbers that one typing error makes of a number, each once for a kind of error."""
    seen: set[tuple[How, str]] = set()
    for how, variant in _slips(text):
        try:
            differs = float(variant) != float(text)
        except ValueError:
            continue
        if differs and (how, variant) not in seen:
            seen.add((how, variant))
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
