"""Cards of 80 columns: fields by column, errors with the number and text of the card."""

from __future__ import annotations

from pathlib import Path

from photogram.errors import InputError
from photogram.giant.fields import parse_integer, parse_real

__all__ = ["Card", "Cards"]


class Card:
    """A card: fields are taken by their first and last column, counted from 1.

    Parameters
    ----------
    text
        The card.
    number
        Of the card in its file, from 1.
    file
        The file.
    """

    def __init__(self, text: str, number: int, file: Path | None) -> None:
        self.text, self.number, self.file = text.ljust(80), number, file

    def error(self, message: str) -> InputError:
        """Return an error that names this card."""
        return InputError(message, file=self.file, record=self.number, text=self.text.rstrip())

    def name(self, first: int, last: int) -> str:
        """Return a field as text."""
        return self.text[first - 1 : last].strip()

    def real(self, first: int, last: int, decimals: int = 8) -> float:
        """Return an Ew.d or Fw.d field; blank is zero."""
        try:
            return float(parse_real(self.text[first - 1 : last], decimals))
        except ValueError as error:
            raise self.error(f"columns {first}-{last}: {error}") from None

    def integer(self, first: int, last: int) -> int:
        """Return an Iw field; blank is zero."""
        try:
            return parse_integer(self.text[first - 1 : last])
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
    text
        The whole file.
    file
        Its path.
    """

    def __init__(self, text: str, file: Path | None = None) -> None:
        self._lines, self._file, self._taken = text.splitlines(), file, 0

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
        return Card(self._lines[self._taken - 1], self._taken, self._file)

    @property
    def at_end(self) -> bool:
        """Whether nothing but blank cards is left."""
        return not any(line.strip() for line in self._lines[self._taken :])
