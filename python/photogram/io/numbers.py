"""Numbers in text files: strict spelling, decimal and thousands marks."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

LARGEST_INTEGER = 2**63 - 1  # The largest 64-bit integer

LONGEST = 1_000  # Largest number of characters of a number: 767 digits distinguish any doubles

_WHOLE = re.compile(r"\+?[0-9]+|-[1-9][0-9]*")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_GROUPS = re.compile(r"[+-]?\d{1,3}(?:(?P<mark>['’ \u00a0\u202f.,])\d{3})+(?!\d)")
_SIMPLE = re.compile(r"[+-]?\d*\.?\d*(?:[eE][+-]?\d+)?")
_MARKED = re.compile(r"[+-]?\d[\d'’ \u00a0\u202f.,]*(?:[eE][+-]?\d+)?")
_BLANKS = re.compile(r"(?<=\d)['’ \u00a0\u202f](?=\d{3}(?!\d))")


def is_whole_number(text: str) -> bool:
    """Return whether a text consists of digits 0 to 9."""
    return text.isascii() and text.isdigit()


def whole_number(text: str, lowest: int = 0, highest: int = LARGEST_INTEGER) -> int:
    """Read an integer between two limits, by default not negative."""
    if len(text) > LONGEST or not _WHOLE.fullmatch(text):
        raise InputError(phrase("error.whole", value=text))
    value = int(text)
    if not lowest <= value <= highest:
        raise InputError(phrase("error.whole-range", value=text, low=lowest, high=highest))
    return value


def finite_number(text: str) -> float:
    """Read a number in decimal digits, with or without exponent.

    Other spellings of Python are rejected: NaN and infinity, `1_000`, digits of other alphabets, and numbers
    beyond double precision.
    """
    value = float(text) if len(text) <= LONGEST and _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise InputError(phrase("error.number", value=text))
    return value


def number_or_text(text: str) -> int | float | str:
    """Return the number in a text by the rules of Python, otherwise the text."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


@dataclass(frozen=True)
class Marks:
    """The number format of a table."""

    decimal: str  # Decimal mark, `.` or `,`
    thousands: bool  # Whether a number shows that the other mark separates thousands

    def plain(self, text: str) -> str:
        """Convert a number to a decimal point without marks of thousands.

        Other texts are returned unchanged; the reader of numbers rejects them.
        """
        simple = _SIMPLE.fullmatch(text) is not None
        if not _MARKED.fullmatch(text) or (simple and (self.decimal == "." or "." not in text)):
            return text
        own = _BLANKS.sub("", text)
        other = "," if self.decimal == "." else "."
        head, mark, tail = own.partition(self.decimal)
        if other in head:
            groups = _GROUPS.fullmatch(head)
            if groups is None or groups["mark"] != other or not self.thousands:
                raise InputError(phrase("cells.marks", value=text, decimal=self.decimal, other=other))
            head = head.replace(other, "")
        return f"{head}.{tail}" if mark else head


def marks_of(cells: Iterable[str], delimiter: str) -> Marks:
    """Return the number format of a table, from all cells that look like numbers.

    The last of two different marks in a number is the decimal mark. A repeated mark separates thousands. A
    single mark before groups of three digits is ambiguous; other single marks are decimal marks. If all marks
    are ambiguous, a comma is the decimal mark unless it is the delimiter.
    """
    decimals, thousands = set[str](), set[str]()
    doubtful = ""
    for cell in cells:
        if not ("." in cell or "," in cell) or not _MARKED.fullmatch(cell):
            continue
        mark = cell[max(cell.rfind("."), cell.rfind(","))]
        other = "," if mark == "." else "."
        if other in cell:
            decimals.add(mark)
            thousands.add(other)
        elif _GROUPS.fullmatch(_BLANKS.sub("", cell)):
            if cell.count(mark) > 1:
                thousands.add(mark)
            else:
                doubtful = doubtful if mark == "." else mark
        elif cell.count(mark) == 1:
            decimals.add(mark)
    if thousands:
        return Marks("," if "." in thousands else ".", True)
    if decimals == {"."} or (not decimals and (not doubtful or delimiter == ",")):
        return Marks(".", False)
    return Marks("," if delimiter != "," else ".", False)


TYPED_DECIMALS = 12  # Largest number of decimals in typed numbers

MATRIX_ROUNDING = float(np.degrees(8.0 * np.finfo(float).eps))  # Rounding of angles, degrees


def scaled(values: Floats, factor: float) -> Floats:
    """Return values times a factor, as if they had been typed in the other unit."""
    return _typed(values * factor, 0.0)


def degrees_typed(radians: Floats, rounding: float = 0.0) -> Floats:
    """Return angles in degrees, with the decimals that were typed."""
    return _typed(np.degrees(radians), rounding)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _typed(values: Floats, rounding: float) -> Floats:
    """Return numbers as short decimals if only rounding separates them."""
    size = np.abs(values)
    decimals = np.clip(11.0 - np.floor(np.log10(size)), 0.0, TYPED_DECIMALS)
    short = np.rint(values * 10.0**decimals) / 10.0**decimals
    return np.where(np.abs(short - values) <= 4.0 * np.spacing(size) + rounding, short, values)


ARCSEC = math.pi / 648000.0  # One second of arc in radians


def degrees_minutes_seconds(angle: float, decimals: int) -> tuple[int, int, float]:
    """Split the absolute value of an angle in radians, with rounded seconds.

    The whole value is rounded, so that 60 seconds cannot occur.
    """
    scale: int = 10**decimals
    minutes, units = divmod(round(math.degrees(abs(angle)) * 3600 * scale), 60 * scale)
    return minutes // 60, minutes % 60, units / scale


def degrees_written(angle: float, decimals: int) -> str:
    """Return an angle in degrees, minutes and seconds with decimals."""
    degrees, minutes, seconds = degrees_minutes_seconds(angle, decimals)
    width = decimals + 3 if decimals else 2
    return f"{'-' if angle < 0 else ''}{degrees} {minutes:02d} {seconds:0{width}.{decimals}f}"
