"""Cards of 80 columns: fields by column, errors with the number and text of the card."""

from __future__ import annotations

from pathlib import Path

from photogram.errors import InputError
from photogram.files import read_lines
from photogram.giant.fields import parse_integer, parse_real
from photogram.places import Place

__all__ = ["Card", "Cards"]


class Card(Place):
    """A card: fields are taken by their first and last column, counted from 1."""

    def columns(self, first: int, last: int) -> str:
        """Return columns as they are; short cards end in blanks."""
        return (self.text or "").ljust(80)[first - 1 : last]

    def name(self, first: int, last: int) -> str:
        """Return a field as text."""
        return self.columns(first, last).strip()

    def real(self, first: int, last: int, decimals: int = 8) -> float:
        """Return an Ew.d or Fw.d field; blank is zero."""
        try:
            return float(parse_real(self.columns(first, last), decimals))
        except ValueError as error:
            raise self.error(f"columns {first}-{last}: {error}") from None

    def integer(self, first: int, last: int) -> int:
        """Return an Iw field; blank is zero."""
        try:
            return parse_integer(self.columns(first, last))
        except ValueError as error:
            raise self.error(f"columns {first}-{last}: {error}") from None

    def reals(self, first: int, width: int, count: int, decimals: int = 8) -> list[float]:
        """Return consecutive fields of equal width."""
        starts = range(first, first + width * count, width)
        return [self.real(start, start + width - 1, decimals) for start in starts]


class Cards:
    """The cards of a file, taken one after the other.

    Parameters
    ----------
    file
        A card a line.

    Raises
    ------
    InputError
        The file cannot be read.
    """

    def __init__(self, file: Path) -> None:
        self._lines, self._file, self._taken = read_lines(file), file, 0

    def take(self, what: str) -> Card:
        """Return the next card, which holds what is named.

        Raises
        ------
        InputError
            The deck is at its end.
        """
        if self._taken >= len(self._lines):
            raise InputError(
                f"the deck ends where {what} is expected", file=self._file, record=self._taken + 1
            )
        self._taken += 1
        return Card(self._file, self._taken, self._lines[self._taken - 1])

    @property
    def at_end(self) -> bool:
        """Whether nothing but blank cards is left."""
        return not any(line.strip() for line in self._lines[self._taken :])
