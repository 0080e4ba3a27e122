"""Widths of words, and free places for names: pictures are laid out before they are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from photogram.arguments.types import Floats

Box: TypeAlias = tuple[float, float, float, float]  # Left, low, right and high side
# Advance widths of DejaVu Sans 2.37 from space to tilde, in thousandths of the size. Of the letters that
# pages have it is the widest, so that what fits with it fits with the others.
_ASCII = (
    "318 401 460 838 636 950 780 275 390 390 500 838 318 361 318 337 636 636 636 636 636 636 636 636 636 636"
    " 337 337 838 838 838 531 1000 684 686 698 770 632 575 775 752 295 295 656 557 863 748 787 603 787"
    " 695 635 611 732 684 989 685 611 685 390 337 390 838 500 500 613 635 550 635 615 352 635 634 278"
    " 278 579 278 974 634 612 635 635 411 521 392 634 592 818 592 592 525 636 337 636 838"
)
_WIDTHS = {chr(32 + k): int(width) for k, width in enumerate(_ASCII.split())} | dict.fromkeys("±×−", 838)
_OTHER = 640  # Latin, Greek and Cyrillic letters, about
_EAST_ASIAN = 1000  # Letters from 0x2E80


def width(text: str, size: float) -> float:
    """Return how wide a line of text is, in the unit of the size of its letters."""
    return (
        size / 1000.0 * sum(_WIDTHS.get(each, _EAST_ASIAN if each >= "\u2e80" else _OTHER) for each in text)
    )


def widest(texts: Sequence[str], size: float) -> float:
    """Return how wide the widest of some lines is; 0 of none."""
    return max((width(text, size) for text in texts), default=0.0)


def wrapped(text: str, size: float, room: float) -> list[str]:
    """Return a text as lines that are no wider than there is room, broken between words and where it is."""
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


def free_side(
    size: tuple[float, float],
    place: tuple[float, float],
    gap: float,
    taken: Sequence[Box],
    places: Floats,
    room: Box,
) -> Box | None:
    """Return the box of a name at one of eight sides of its place; None if no side is free.

    It has a distance `gap` from the place, is within `room`, and covers neither `taken` boxes nor `places`.
    """
    (width, height), (x, y) = size, place
    across = (x + gap, x - width / 2, x - gap - width)
    up = (y + gap, y - height / 2, y - gap - height)
    for i, j in ((0, 0), (2, 2), (2, 0), (0, 2), (0, 1), (2, 1), (1, 0), (1, 2)):
        box = left, low, right, high = across[i], up[j], across[i] + width, up[j] + height
        inside = room[0] <= left and right <= room[2] and room[1] <= low and high <= room[3]
        hit = ((places > [left, low]) & (places < [right, high])).all(axis=1).any()
        if inside and not hit and not any(overlap(box, other) for other in taken):
            return box
    return None


def overlap(one: Box, other: Box) -> bool:
    """Return whether two boxes have something in common."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
