"""Widths of words, and free positions for names: the layout precedes the drawing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass

Box: TypeAlias = tuple[float, float, float, float]  # Left, low, right and high side
NOWHERE = np.empty((0, 2))
SIDES = ((0, 0), (2, 2), (2, 0), (0, 2), (0, 1), (2, 1), (1, 0), (1, 2))  # Of a point, in the order of trial
# Advance widths of DejaVu Sans 2.37 from space to tilde, in thousandths of the size. It is the widest of the
# fonts of pages, so that the text also fits with the others.
_ASCII = (
    "318 401 460 838 636 950 780 275 390 390 500 838 318 361 318 337 636 636 636 636 636 636 636 636 636 636"
    " 337 337 838 838 838 531 1000 684 686 698 770 632 575 775 752 295 295 656 557 863 748 787 603 787"
    " 695 635 611 732 684 989 685 611 685 390 337 390 838 500 500 613 635 550 635 615 352 635 634 278"
    " 278 579 278 974 634 612 635 635 411 521 392 634 592 818 592 592 525 636 337 636 838"
)
_WIDTHS = {chr(32 + k): int(width) for k, width in enumerate(_ASCII.split())} | dict.fromkeys("±×−", 838)
_OTHER = 640  # Latin, Greek and Cyrillic letters, approximately
_EAST_ASIAN = 1000  # Letters from 0x2E80


def width(text: str, size: float) -> float:
    """Return the width of a line of text, in the unit of the letter size."""
    return (
        size / 1000.0 * sum(_WIDTHS.get(each, _EAST_ASIAN if each >= "\u2e80" else _OTHER) for each in text)
    )


def widest(texts: Sequence[str], size: float) -> float:
    """Return the largest width of some lines; 0 without lines."""
    return max((width(text, size) for text in texts), default=0.0)


def wrapped(text: str, size: float, room: float) -> list[str]:
    """Return lines of a text within a width, broken between words."""
    lines: list[str] = []
    for given in text.split("\n"):
        own: list[str] = []
        for word in given.split():
            longer = f"{own[-1]} {word}" if own else word
            if own and width(longer, size) <= room:
                own[-1] = longer
            else:
                own.append(word)
        lines += own
    return lines


def free_names(
    texts: Sequence[str],
    places: Floats,
    avoid: Floats,
    size: float,
    room: Box,
    taken: list[Box],
    centred: bool = False,
) -> Iterator[tuple[int, Box]]:
    """Yield rows and boxes of names that fit at one of eight sides of their points, or at their centre.

    Boxes are within `room`. They cover no other point, none of `avoid`, and none of the boxes `taken`, to
    which they are added. `size` is the letter size.
    """
    obstacles = avoid if centred else np.concatenate([places, avoid])
    gap, high = 4.0 / 7.0 * size, 8.0 / 7.0 * size
    for row, (text, (x, y)) in enumerate(zip(texts, places.tolist(), strict=True)):
        wide = width(text, size) + 0.8 / 7.0 * size
        across, up = (x + gap, x - wide / 2, x - gap - wide), (y + gap, y - high / 2, y - gap - high)
        for i, j in ((1, 1),) if centred else SIDES:
            box = left, low, right, top = across[i], up[j], across[i] + wide, up[j] + high
            inside = room[0] <= left and right <= room[2] and room[1] <= low and top <= room[3]
            if not inside or ((obstacles > [left, low]) & (obstacles < [right, top])).all(axis=1).any():
                continue
            if not any(overlap(box, other) for other in taken):
                taken.append(box)
                yield row, box
                break


def overlap(one: Box, other: Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


MAX_STEPS = 8
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True, eq=False)
class Ticks:
    """Values along an axis with texts; `power` is added to the axis name."""

    values: Floats
    texts: list[str]
    power: str = ""

    def named(self, name: str) -> str:
        """Return the name of the axis with the power of ten of its numbers."""
        return f"{name} (× {self.power})".strip() if self.power else name


def ticks(
    limits: Floats, length: float, size: float, *, across: bool, log: bool = False, decimal: str = "."
) -> Ticks:
    """Return ticks of an axis with (2,) limits; `length` and `size` in points, `decimal` the decimal sign.

    With `across`, numbers are next to each other. Logarithmic axes have 1, 2, 5 times powers of ten.
    """
    low, high = sorted(limits.tolist())
    for values, step in _candidates(low, high, log):
        places = np.log(values / low) / math.log(high / low) if log else (values - low) / (high - low)
        found = _written(values, step, decimal)
        room = widest(found.texts, size) + 1.6 * size if across else 2.6 * size
        if len(values) > 1 and (np.diff(places) * length > room).all():
            return found
    # A short axis without space for two of these has its ends, or one of them.
    ends = _written(np.unique([low, high]), (high - low) / 100.0, decimal)
    fit = not across or widest(ends.texts, size) + size < length
    return ends if fit else _written(ends.values[:1], (high - low) / 100.0, decimal)


def _candidates(low: float, high: float, log: bool) -> Iterator[tuple[Any, float]]:
    """Yield values between limits with their step, many first; ratios have the step 0."""
    if log:
        powers = 10.0 ** np.arange(math.floor(math.log10(low)), math.floor(math.log10(high)) + 1)
        for steps in ((1.0, 2.0, 5.0), (1.0, 5.0), (1.0,)):
            every = np.outer(powers, steps).ravel()
            yield every[(every >= low * (1 - 1e-9)) & (every <= high * (1 + 1e-9))], 0.0
    least = (high - low) / MAX_STEPS
    power = 10.0 ** math.floor(math.log10(least)) if least > 0 else 0.0
    for step in (factor * power for factor in (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)):
        if step >= least * (1 - 1e-9) > 0:
            yield step * np.arange(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1), step


def _written(values: Floats, step: float, decimal: str) -> Ticks:
    largest, power = float(np.abs(values).max(initial=0.0)), 0
    if largest > 0 and step and not 1e-3 <= largest < 1e8:
        power = math.floor(math.log10(largest))
    decimals = min(max(0, power - math.floor(math.log10(step) + 1e-9)), 15) if step > 0 else 0
    layout = f".{decimals}f" if step else "g"
    texts = [f"{value / 10.0**power:{layout}}" for value in values.tolist()]
    texts = [text.lstrip("-") if not text.strip("-0.") else text.replace("-", "−") for text in texts]
    texts = [text.replace(".", decimal) for text in texts]
    return Ticks(values, texts, f"10{str(power).translate(SUPERSCRIPT)}" if power else "")
