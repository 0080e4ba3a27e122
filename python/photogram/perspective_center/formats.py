"""Cards read by a FORMAT that stands on a card itself, by the rules of FORTRAN IV.

The package fortranformat reads the FORMAT and the numbers. What FORTRAN IV (1969) does otherwise than later
FORTRAN, and what a card must be refused for, is here: blanks inside a field count as zeros, a card has eighty
columns, and NaN has no spelling.
"""

from __future__ import annotations

import math
import re

import fortranformat

from photogram.io.records import Record
from photogram.lazy_dataclasses import dataclass

__all__ = ["CardFormat"]

COLUMNS = 80
_NUMERIC = re.compile(r"([IFED])(\d+)(?:\.\d+)?", re.ASCII)
_ALLOWED = re.compile(r"(?:\d*[IFED]\d+(?:\.\d+)?|\d*X|T\d+|\d*\(|[),])+", re.ASCII)
_NUMBERS = {
    int: re.compile(r"[+-]?\d+", re.ASCII),
    float: re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[ED][+-]?\d+|[+-]\d+)?", re.ASCII),
}
_NAMES = {int: "whole number", float: "number"}
_FIRST = 0x2500
"""A ruler: characters that occur in no card and count its columns."""


@dataclass(frozen=True)
class _Field:
    """Columns of a field, from 0 and the last excluded, and what it holds."""

    first: int
    last: int
    kind: type[int] | type[float]


class CardFormat:
    """The FORMAT of a card with a whole number, then real numbers.

    Parameters
    ----------
    text
        For example `(I4,2F10.0)`: the descriptors I, F, E, D, X and T, repeats and groups. What follows the
        closing parenthesis is not looked at.
    reals, integers
        How many numbers are wanted of it; the FORMAT may have more.

    Raises
    ------
    ValueError
        A FORMAT that gives no such numbers from one card.
    """

    def __init__(self, text: str, *, reals: int, integers: int = 1) -> None:
        self.text = _parenthesised("".join(text.split()).upper())
        if _ALLOWED.fullmatch(self.text) is None:
            raise ValueError(f"{self.text} holds more than the descriptors I, F, E, D, X and T")
        _check_sizes(self.text)
        try:
            self._reader = fortranformat.FortranRecordReader(self.text)
            ruler = "".join(chr(_FIRST + column) for column in range(4 * COLUMNS))
            # Read as text, the ruler says which columns a field has; a card of zeros, what it holds.
            fields = fortranformat.FortranRecordReader(_NUMERIC.sub(r"A\2", self.text)).read(ruler)
            kinds = [type(value) for value in self._reader.read("0" * 4 * COLUMNS)]
        except Exception as error:  # fortranformat raises many kinds of exceptions, some of them its own
            raise ValueError(f"{self.text} is no FORMAT: {error}") from None
        wanted = [int] * integers + [float] * reals
        if kinds[: len(wanted)] != wanted:
            raise ValueError(
                f"{self.text} does not give {integers} whole and {reals} real numbers in this order"
            )
        columns = [(ord(field[0]) - _FIRST, ord(field[-1]) - _FIRST + 1) for field in fields[: len(wanted)]]
        if max(last for _, last in columns) > COLUMNS:
            raise ValueError(f"{self.text} reaches beyond column {COLUMNS}")
        self._fields = [_Field(*place, kind) for place, kind in zip(columns, wanted, strict=True)]

    @classmethod
    def of(cls, record: Record, *, reals: int) -> CardFormat:
        """Take the FORMAT that stands on a card.

        Raises
        ------
        InputError
            A FORMAT that gives no whole number and that many real numbers.
        """
        try:
            return cls(record.text, reals=reals)
        except ValueError as error:
            raise record.error(str(error)) from None

    def read(self, record: Record) -> list[float]:
        """Read the numbers of a card; whole numbers come as integers.

        Raises
        ------
        InputError
            A field that is no number.
        """
        card = record.text.ljust(COLUMNS)
        for field in self._fields:
            card = card[: field.first] + self._filled(field, record, card) + card[field.last :]
        values: list[float] = self._reader.read(card)
        return values[: len(self._fields)]

    def _filled(self, field: _Field, record: Record, card: str) -> str:
        """Return the characters of a field with zeros for the blanks that FORTRAN IV takes for zeros."""
        raw = card[field.first : field.last].upper()
        digits = raw.lstrip(" ").replace(" ", "0")
        place = f"columns {field.first + 1}-{field.last}"
        if digits and _NUMBERS[field.kind].fullmatch(digits) is None:
            raise record.error(f"{place}: {raw.strip()!r} is not a {_NAMES[field.kind]} ({self.text})")
        counts = " " in raw.lstrip(" ") and (field.kind is int or "." not in raw or "E" in raw or "D" in raw)
        if counts:
            record.remark(f"{place}: the blanks in {raw!r} count as zeros, which makes it {digits}")
        return digits.rjust(field.last - field.first)


def _check_sizes(text: str) -> None:
    """Refuse what cannot stand on a card, before any memory or time is spent on it."""
    # Nine digits do: int() has a limit of its own.
    numbers = [int(digits[:9]) for digits in re.findall(r"[0-9]+", text)]
    groups = math.prod(int(digits[:9]) for digits in re.findall(r"([0-9]+)\(", text))
    if max(numbers, default=0) > COLUMNS or groups > COLUMNS**2:
        raise ValueError(f"{text} holds repeats, widths or columns beyond the {COLUMNS} columns of a card")


def _parenthesised(text: str) -> str:
    """Return the text up to the parenthesis that closes the first one."""
    depth = 0
    for position, character in enumerate(text):
        depth += (character == "(") - (character == ")")
        if depth == 0 and position > 0:
            return text[: position + 1]
        if depth == 0:
            break
    raise ValueError(f"{text!r} is no FORMAT in parentheses")
