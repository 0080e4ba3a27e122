"""Widths of words, and numbers along axes: the layout precedes the drawing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from photogram.arguments.types import Floats

# Advance widths of DejaVu Sans 2.37 from space to tilde, in thousandths of the size. It is the widest of the
# fonts of pages, so that the text also fits with the others.
_ASCII = (
    "318 401 460 838 636 950 780 275 390 390 500 838 318 361 318 337 636 636 636 636 636 636 636 636 636 636"
    " 337 337 838 838 838 531 1000 684 686 698 770 632 575 775 752 295 295 656 557 863 748 787 603 787"
    " 695 635 611 732 684 989 685 611 685 390 337 390 838 500 500 613 635 550 635 615 352 635 634 278"
    " 278 579 278 974 634 612 635 635 411 521 392 634 592 818 592 592 525 636 337 636 838"
)
_WIDTHS = {chr(32 + k): int(width) for k, width in enumerate(_ASCII.split())} | dict.fromkeys("±×−", 838)
EAST_ASIAN = "\u2e80"  # First of the letters with a width of 1000; others have 640, approximately


@cache
def width(text: str, size: float) -> float:
    """Return the width of a line of text, in the unit of the letter size."""
    return sum(_WIDTHS.get(sign, 1000 if sign >= EAST_ASIAN else 640) for sign in text) * size / 1000.0


def widest(texts: Sequence[str], size: float) -> float:
    """Return the largest width of some lines; 0 without lines."""
    return max((width(text, size) for text in texts), default=0.0)


def wrapped(text: str, size: float, room: float) -> list[str]:
    """Return lines of a text within a width, broken between words."""
    lines: list[str] = []
    for paragraph in text.split("\n"):
        lines.append("")
        for word in paragraph.split():
            longer = f"{lines[-1]} {word}".lstrip()
            if lines[-1] and width(longer, size) > room:
                lines.append(word)
            else:
                lines[-1] = longer
    return [line for line in lines if line]


MAX_STEPS = 8


class Ticks(NamedTuple):
    """Values along an axis with texts."""

    values: Floats
    texts: list[str]


def ticks(
    limits: Floats, length: float, size: float, *, across: bool = False, log: bool = False, decimal: str = "."
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
    largest = float(np.abs(values).max(initial=0.0))
    decimals = min(max(0, -math.floor(math.log10(step) + 1e-9)), 15) if step > 0 else 0
    layout = f"z.{decimals}f" if step and (largest == 0 or 1e-3 <= largest < 1e8) else "z.10g"
    texts = [f"{value:{layout}}".replace("-", "−").replace(".", decimal) for value in values.tolist()]
    return Ticks(values, texts)
