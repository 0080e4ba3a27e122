"""Forms of the printout: pages and numbers as in FORTRAN."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.io.numbers import degrees_minutes_seconds
from photogram.lazy_dataclasses import dataclass

Page = list[str]  # The lines of a page below its banner

WIDTH = 132  # Columns of a line printer without carriage control
LINES = 52
"""Lines of entries per page: 13 stations, 52 points of one line or 13 of four, 10 control points of five."""

BANNER = "NOAA/NOS GIANT SYSTEM .... (4/85) : "


def headed(title: str, *lines: str) -> Page:
    """Return a page heading: a centred spaced title, and further lines."""
    spaced = "   ".join(" ".join(word) for word in title.split())
    return ["", spaced.center(WIDTH).rstrip(), "", *lines, ""]


def paginate(
    heading: Sequence[str],
    entries: Iterable[Sequence[str]],
    *,
    again: Sequence[str] | None = None,
    closing: Sequence[str] = (),
) -> list[Page]:
    """Fill pages with entries of one or more lines, which are never split.

    `again` (the heading if None) begins the other pages; a longer heading leaves less space for entries.
    `closing` follows the last entry, on its page if it fits completely.
    """
    again = heading if again is None else again
    length = len(again) + LINES
    pages, empty = [list(heading)], True
    for entry in [*entries, closing]:
        if not empty and len(pages[-1]) + len(entry) > length:
            pages.append(list(again))
        pages[-1] += entry
        empty = False
    return pages


def printout(title: str, pages: Iterable[Page]) -> str:
    """Return pages as text, numbered from 0, with title and FORTRAN carriage control.

    The first character of a line is the carriage control: `1` begins a page, a blank (or nothing) a line.
    """
    lines: list[str] = []
    for number, page in enumerate(pages):
        lines.append(f"1{BANNER}{title:<80}  PAGE{number:>5}")
        lines += [f" {line}".rstrip() for line in page]
    return "".join(f"{line}\n" for line in lines)


VALUE = 15
"""Columns of a value: sign, degrees, minutes and seconds (A1, I3, I3, F8.4), or a length of equal width."""

UNITS = {"m": "METERS", "ft": "FEET"}

Values = Iterable[float]


def fixed(value: float, width: int, decimals: int) -> str:
    """Write a number as Fw.d, wider if necessary; NaN is blank, zero without sign."""
    text = "" if math.isnan(value) else f"{value:.{decimals}f}"
    return (text.removeprefix("-") if text.strip("-0.") == "" else text).rjust(width)


def exponential(value: float) -> str:
    """Write a number as E10.3: `0.377E-13`; NaN is blank."""
    if math.isnan(value):
        return " " * 10
    mantissa, _, power = f"{value + 0.0:.2e}".partition("e")
    exponent = int(power) + 1 if value else 0
    # A three-digit exponent replaces the letter.
    shown = f"E{exponent:+03d}" if abs(exponent) < 100 else f"{exponent:+04d}"
    sign = "-" if value < 0 else ""
    return f"{sign}0.{mantissa.lstrip('-').replace('.', '')}{shown}".rjust(10)


def dms(angle: float, *, circle: bool = False) -> str:
    """Write radians as sign, degrees, minutes, seconds (A1, I3, I3, F8.4).

    `circle` converts 360 degrees, a possible result of rounding, to zero.
    """
    if math.isnan(angle):
        return " " * VALUE
    degrees, minutes, seconds = degrees_minutes_seconds(angle, 4)
    if circle:
        degrees %= 360
    sign = "-" if angle < 0 and (degrees or minutes or seconds) else " "
    return f"{sign}{degrees:3d}{minutes:3d}{seconds:8.4f}"


def attitude(angles: Values) -> list[str]:
    """Write omega, phi (-180 to 180 degrees) and kappa (0 to 360 degrees)."""
    omega, phi, kappa = angles
    return [
        *(dms(math.remainder(angle, math.tau)) for angle in (omega, phi)),
        dms(kappa % math.tau, circle=True),
    ]


def attitude_name(photo_to_ground: bool) -> str:
    """Return the sense of the angles in the words of the headings."""
    return "PHOTO TO GROUND" if photo_to_ground else "GROUND TO PHOTO"


@dataclass(frozen=True)
class Space:
    """Names and format of coordinates of the object space."""

    geographic: bool  # Longitude, latitude and elevation, or X, Y and Z
    unit: str = "m"  # The linear unit of a block

    @property
    def names(self) -> tuple[str, str, str]:
        """The three components, in three characters each."""
        return ("LNG", "LAT", "ELV") if self.geographic else ("X  ", "Y  ", "Z  ")

    @property
    def linear_unit(self) -> str:
        """The linear unit in words."""
        return UNITS.get(self.unit, self.unit.upper())

    @property
    def units(self) -> str:
        """The units of the three components."""
        angle = "RADIANS" if self.geographic else self.linear_unit
        return ", ".join((angle, angle, self.linear_unit))

    def values(self, position: Values, decimals: int) -> list[str]:
        """Write three coordinates, differences or standard deviations."""
        first, second, third = position
        planimetry = (
            [dms(first), dms(second)]
            if self.geographic
            else [fixed(first, VALUE, decimals), fixed(second, VALUE, decimals)]
        )
        return [*planimetry, fixed(third, VALUE, decimals)]


MATRIX = 33  # Columns of a row of a matrix: three numbers (1X, E10.3)


def matrix_rows(covariance: Floats | None) -> Sequence[str]:
    """Write the three rows of a (3, 3) matrix, or three empty ones without a matrix."""
    if covariance is None:
        return ["", "", ""]
    return ["".join(f" {exponential(value)}" for value in row) for row in covariance.tolist()]


def counts_and_rms(values: Floats, counted: Bools) -> tuple[list[int], list[float]]:
    """Return counts of values in three columns, and root mean squares."""
    count = counted.sum(axis=0)
    squares = np.where(counted, values**2, 0.0).sum(axis=0)
    rms = np.sqrt(np.divide(squares, count, out=np.full(3, np.nan), where=count > 0))
    return count.tolist(), rms.tolist()
