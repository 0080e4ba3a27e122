"""Parts of a picture, 5 across and 4 down, in words: where a board was, and where to hold it next."""

from __future__ import annotations

from collections.abc import Iterator

from photogram.lazy_dataclasses import dataclass

PARTS = (5, 4)  # across and down
ACROSS = ("left", "left of the middle", "", "right of the middle", "right")
DOWN = ("upper", "above the middle", "below the middle", "lower")


@dataclass(frozen=True)
class PicturePart:
    """A part of a picture: its column and row, its middle in pixels, and what it is called."""

    cell: tuple[int, int]
    middle: tuple[float, float]
    name: str


def parts_of(size: tuple[int, int]) -> Iterator[PicturePart]:
    """Yield the parts of a picture of a width and a height, row by row."""
    for row in range(PARTS[1]):
        for column in range(PARTS[0]):
            x, y = (
                (each + 0.5) / count * (side - 1)
                for each, count, side in zip((column, row), PARTS, size, strict=True)
            )
            yield PicturePart((column, row), (x, y), _name(column, row))


def _name(column: int, row: int) -> str:
    """Return a part in words: `upper left corner`, `left edge, above the middle`, `below the middle`."""
    at_side, at_end = column in (0, PARTS[0] - 1), row in (0, PARTS[1] - 1)
    if at_side and at_end:
        return f"{DOWN[row]} {ACROSS[column]} corner"
    if at_side or at_end:
        edge, along = (ACROSS[column], DOWN[row]) if at_side else (DOWN[row], ACROSS[column])
        return f"{edge} edge" + (f", {along}" if along else "")
    return " and ".join(filter(None, (DOWN[row], ACROSS[column])))
