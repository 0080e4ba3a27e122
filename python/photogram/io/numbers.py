"""Numbers in text files: one strict spelling, and the marks by which tables divide decimals and thousands."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

LARGEST_INTEGER = 2**63 - 1  # The largest that an array of 64-bit integers holds

LONGEST = 1_000  # Characters of a number at most: 767 digits tell any two numbers of double precision apart

_WHOLE = re.compile(r"\+?[0-9]+")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_GROUPS = re.compile(r"[+-]?\d{1,3}(?:(?P<mark>['’ \u00a0\u202f.,])\d{3})+(?!\d)")
_SIMPLE = re.compile(r"[+-]?\d*\.?\d*(?:[eE][+-]?\d+)?")
_MARKED = re.compile(r"[+-]?\d[\d'’ \u00a0\u202f.,]*(?:[eE][+-]?\d+)?")
_BLANKS = re.compile(r"(?<=\d)['’ \u00a0\u202f](?=\d{3}(?!\d))")


def is_whole_number(text: str) -> bool:
    """Whether a text is digits 0 to 9 and nothing else; other alphabets, superscripts and signs are not."""
    return text.isascii() and text.isdigit()


def whole_number(text: str, lowest: int = 0, highest: int = LARGEST_INTEGER) -> int:
    """Read a whole number between two limits, which is not negative by default."""
    if len(text) > LONGEST or not _WHOLE.fullmatch(text):
        raise InputError(phrase("error.whole", value=text))
    value = int(text)
    if not lowest <= value <= highest:
        raise InputError(phrase("error.whole-range", value=text, low=lowest, high=highest))
    return value


def finite_number(text: str) -> float:
    """Read a number in decimal digits, with an exponent or without.

    What Python reads besides is refused: NaN and infinity, `1_000`, digits of other alphabets, and numbers
    beyond double precision.
    """
    value = float(text) if len(text) <= LONGEST and _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise InputError(phrase("error.number", value=text))
    return value


def number_or_text(text: str) -> int | float | str:
    """Return the number that a text is by the rules of Python, else the text."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


@dataclass(frozen=True)
class Marks:
    """How the numbers of a table are written."""

    decimal: str  # What divides decimals, `.` or `,`
    thousands: bool  # Whether a number shows that the other of both divides thousands

    def plain(self, text: str) -> str:
        """Return a number as it is spelled here: a decimal point, no marks of thousands.

        Anything else comes back as it is, for whoever reads numbers to refuse.
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
    """Return how the numbers of a table are written, from all its cells that look like numbers.

    The last of both marks in one number divides decimals; a mark that stands twice in one does not, and
    neither does one before which or behind which digits are not in threes. Where nothing tells, a comma
    divides decimals unless it divides cells.
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
        elif cell.count(mark) > 1:
            thousands.add(mark)
        elif _GROUPS.fullmatch(_BLANKS.sub("", cell)):
            doubtful = doubtful if mark == "." else mark
        else:
            decimals.add(mark)
    if thousands:
        return Marks("," if "." in thousands else ".", True)
    if decimals == {"."} or (not decimals and (not doubtful or delimiter == ",")):
        return Marks(".", False)
    return Marks("," if delimiter != "," else ".", False)
