"""Where names go beside their places: none over another, over a place, or beyond the panel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from photogram.arguments.types import Floats

Box: TypeAlias = tuple[float, float, float, float]  # Left, low, right and high side


def free_side(
    size: tuple[float, float],
    place: tuple[float, float],
    gap: float,
    taken: Sequence[Box],
    places: Floats,
    room: Box,
) -> Box | None:
    """Return where a name is free to stand, to one of eight sides of its place; None where it is nowhere.

    Parameters
    ----------
    size
        Width and height of the name.
    place, gap
        What it names, and how far it is from there.
    taken
        Boxes that it must not touch.
    places
        (a, 2) places that it must not cover.
    room
        What it stays within.
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
