"""Records of GIANT files: fields by columns (GIANT guide, II.B)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self, TypeVar

from photogram.errors import InputError
from photogram.giant.fields import format_deviations, parse_angle, parse_name
from photogram.io import records
from photogram.io.records import parse_integer, parse_real
from photogram.messages import Message
from photogram.words import Phrase, phrase

T = TypeVar("T")
QUARTER_CIRCLE = math.pi / 2 + 1e-12  # The largest latitude, with a tolerance for rounding


@dataclass(frozen=True, eq=False)
class Source(records.Source):
    strip: str = ""  # The leading character removed from names (COMMON column 15), or empty

    @classmethod
    def read(cls, path: Path, strip: str = "") -> Self:
        """Read a file, as :meth:`photogram.io.records.Source.read` does."""
        return replace(super().read(path), strip=strip)

    def record(self, number: int) -> Record:
        """Return the record of a number, from 1."""
        return Record(self, number)

    def records(self) -> list[Record]:
        """Return the records that are not blank."""
        return [self.record(number) for number in self.filled()]

    def point_names(self, numbers: list[int]) -> list[str]:
        """Read the names of points in columns 1-8 of many records."""
        fields = [self.lines[number - 1][:8].rstrip(" ") for number in numbers]
        names = {text: parse_name(text, self.strip) for text in set(fields)}
        if len(set(names.values())) < len(names) or "" in names:
            spellings: dict[str, Record] = {}
            for number in numbers:
                if not self.record(number).identification(spellings):
                    raise self.record(number).error(phrase("giant.no-name", subject="point"))
        return [names[text] for text in fields]


@dataclass(frozen=True, slots=True)
class Record(records.Record):
    """One record, with the fields that GIANT files have."""

    source: Source

    def name(self, first: int) -> str:
        """Read an eight-character name (2A4)."""
        return parse_name(self.columns(first, first + 7), self.source.strip)

    def identification(self, spellings: dict[str, Record]) -> str:
        """Read the name in columns 1-8 and reject a second spelling of one name.

        `spellings` collects the first record of every name. Removal of a leading character, or of blanks, can
        make two names equal.
        """
        name = self.name(1)
        first = spellings.setdefault(name, self)
        if first.columns(1, 8).rstrip(" ") != self.columns(1, 8).rstrip(" "):
            raise self.error(
                phrase(
                    "giant.same-name",
                    first=self.columns(1, 8),
                    second=first.columns(1, 8),
                    record=first.number,
                    name=name,
                )
            )
        return name

    def integer(self, first: int, last: int) -> int:
        """Read an Iw field."""
        return self._parse(first, last, "whole number", parse_integer)

    def real(self, first: int, last: int, decimals: int = 3) -> float:
        """Read an Fw.d field."""
        width = last - first + 1
        value = float(
            self._parse(first, last, f"F{width}.{decimals}", lambda text: parse_real(text, decimals))
        )
        if abs(value) >= 10**width:
            # As for standard deviations: the output files have the same columns.
            raise self.error(phrase("giant.range", first=first, last=last, value=value, width=width))
        return value

    def angle(self, first: int, last: int, decimals: int = 3) -> float:
        """Read a packed DMS field as radians."""
        angle, doubtful = self._parse(first, last, "DMS", lambda text: parse_angle(text, decimals))
        if doubtful:
            text = self.columns(first, last).strip()
            self.remark(phrase("giant.sixty", first=first, last=last, value=text))
        return angle

    def deviation(self, first: int, last: int, *, angle: bool = False) -> float:
        """Read a standard deviation, F10.3 or DMS; zero means the default."""
        value = self.angle(first, last) if angle else self.real(first, last)
        if value < 0:
            raise self.error(phrase("giant.negative-sd", first=first, last=last, value=value))
        try:
            format_deviations((value,), (angle,))
        except ValueError:
            # An exponent allows values that the output files cannot repeat.
            raise self.error(phrase("giant.sd-range", first=first, last=last, value=value)) from None
        return value

    def position(self, geographic: bool) -> tuple[float, float, float]:
        """Read columns 9-44 (F12.3): X, Y, Z, or longitude and latitude (rad) and height."""
        if not geographic:
            return self.real(9, 20), self.real(21, 32), self.real(33, 44)
        longitude, latitude, height = self.angle(9, 20), self.angle(21, 32), self.real(33, 44)
        if abs(latitude) > QUARTER_CIRCLE:
            raise self.error(phrase("giant.latitude", value=math.degrees(latitude)))
        return longitude, latitude, height

    def attitude(self) -> tuple[float, float, float]:
        """Read columns 9-44 as omega, phi and kappa in radians."""
        return self.angle(9, 20), self.angle(21, 32), self.angle(33, 44)

    def deviations(self, *angles: bool) -> tuple[float, float, float]:
        """Read standard deviations of columns 45-74; `angles`: DMS fields."""
        first, second, third = angles
        return (
            self.deviation(45, 54, angle=first),
            self.deviation(55, 64, angle=second),
            self.deviation(65, 74, angle=third),
        )

    def _parse(self, first: int, last: int, format_: str, parse: Callable[[str], T]) -> T:
        columns = self.columns(first, last)
        try:
            value = parse(columns)
        except ValueError as error:
            raise self.error(
                phrase("giant.field", first=first, last=last, format=format_, error=str(error))
            ) from None
        if " " in columns.strip(" "):
            self.remark(phrase("giant.blanks", first=first, last=last, value=columns.strip()))
        return value


def error_at(record: Record | None, text: Phrase) -> InputError:
    """Return an error about a record; without a record, no location."""
    return record.error(text) if record else InputError(text)


def message_at(record: Record | None, text: Phrase) -> Message:
    """Return a remark on a record; without a record, no location."""
    return record.message(text) if record else Message(text)
