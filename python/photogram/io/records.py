"""A file as numbered records of fixed columns, and numbers in FORTRAN formats."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Self

from photogram.errors import InputError
from photogram.io.files import read_lines
from photogram.io.places import Place
from photogram.messages import Message
from photogram.words import Phrase, phrase

WIDTH = 80
WIDE = 0.25  # Fraction of zero bytes that indicates other encodings than one byte per character
LARGEST_EXPONENT = 400  # Larger than the exponent of every double, including digits around the point
_REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[EeDd]([+-]?\d+)|([+-]\d+))?", re.ASCII)
_INTEGER = re.compile(r"[+-]?\d+", re.ASCII)


@dataclass(frozen=True, eq=False)
class Source:
    path: Path  # Path of the file
    lines: list[str]  # Its records without line ends, cut after column 80
    messages: list[Message] = field(default_factory=list)  # Remarks of the reader

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a text file as :func:`~photogram.io.files.read_lines` does."""
        lines = read_lines(path)
        text = "".join(lines)
        if text.count("\0") > WIDE * len(text):
            raise InputError(phrase("file.wide"), file=path)
        source = cls(path, [line[:WIDTH] for line in lines])
        if "".join(source.lines).isprintable():
            return source
        for number, line in enumerate(source.lines, 1):
            if not line.isprintable():
                character = next(character for character in line if not character.isprintable())
                raise source.record(number).error(phrase("error.unprintable", value=character))
        return source

    def record(self, number: int) -> Record:
        """Return the record of a number, from 1."""
        return Record(self, number)

    def filled(self) -> list[int]:
        """Return the numbers of the records that are not blank."""
        return [number for number, line in enumerate(self.lines, 1) if line.strip(" ")]

    def error(self, text: str | Phrase) -> InputError:
        """Return an error about the file as a whole."""
        return InputError(text, file=self.path)


@dataclass(frozen=True, slots=True)
class Record:
    """One record; columns are counted from 1, first and last included."""

    source: Source
    number: int

    @property
    def text(self) -> str:
        """The characters of the record."""
        return self.source.lines[self.number - 1]

    @property
    def place(self) -> Place:
        """Location of the record."""
        return Place(self.source.path, self.number, self.text)

    def error(self, text: str | Phrase) -> InputError:
        """Return an error that names file, record number and record."""
        return self.place.error(text)

    def message(self, text: str | Phrase) -> Message:
        """Return a remark that names file, record number and record."""
        return self.place.message(text)

    def remark(self, text: str | Phrase) -> None:
        """Add a remark on this record to the messages of the file."""
        self.source.messages.append(self.message(text))

    def columns(self, first: int, last: int) -> str:
        """Return the characters of a field."""
        return self.text[first - 1 : last]

    def blank(self, first: int, last: int) -> bool:
        return not self.columns(first, last).strip(" ")


def parse_real(field: str, decimals: int) -> Decimal:
    """Read an Fw.d field exactly (FORTRAN 77, ANSI X3.9-1978, 13.5.9.2.1).

    A blank field is zero, blanks inside are ignored (BLANK='NULL'), and without a decimal point the last
    `decimals` digits are the fraction. An exponent follows E or D, with or without a sign, or is a sign and
    digits without a letter: `1.5+2` is 150. NaN and infinity are not supported.
    """
    digits = field.replace(" ", "")
    if not digits:
        return Decimal(0)
    match = _REAL.fullmatch(digits)
    if match is None:
        raise InputError(phrase("error.number", value=field))
    mantissa, lettered, bare = match.groups()
    value, exponent = Decimal(mantissa), int(lettered or bare or 0)
    if not value:
        return value
    exponent = max(-LARGEST_EXPONENT, min(exponent, LARGEST_EXPONENT))
    value = value.scaleb(exponent - (0 if "." in mantissa else decimals))
    if math.isinf(float(value)) or float(value) == 0:
        raise InputError(phrase("error.too-large", value=field))
    return value


def parse_integer(field: str) -> int:
    """Read an Iw field; blank is zero and blanks inside are ignored."""
    digits = field.replace(" ", "")
    if digits and _INTEGER.fullmatch(digits) is None:
        raise InputError(phrase("error.whole", value=field))
    return int(digits or 0)
