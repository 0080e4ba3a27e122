"""Cards of 80 columns: fields as numbers, and the cards of a deck one after the other."""

from __future__ import annotations

from pathlib import Path

from photogram.errors import InputError
from photogram.io.records import Record, Source, parse_integer, parse_real
from photogram.lazy_dataclasses import dataclass

__all__ = ["Card", "Cards"]


@dataclass(frozen=True)
class Card:
    """A card: fields are taken by their first and last column, counted from 1."""

    record: Record

    def error(self, message: str) -> InputError:
        """Return an error that names this card."""
        return self.record.error(message)

    def columns(self, first: int, last: int) -> str:
        """Return columns as they are; short cards have fewer."""
        return self.record.columns(first, last)

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
        self._source, self._taken = Source.read(file), 0

    def take(self, what: str) -> Card:
        """Return the next card, which holds what is named.

        Raises
        ------
        InputError
            The deck is at its end.
        """
        if self._taken >= len(self._source.lines):
            message = f"the deck ends where {what} is expected"
            raise InputError(message, file=self._source.path, record=self._taken + 1)
        self._taken += 1
        return Card(self._source.record(self._taken))

    @property
    def at_end(self) -> bool:
        """Whether nothing but blank cards is left."""
        return not any(number > self._taken for number in self._source.filled())
