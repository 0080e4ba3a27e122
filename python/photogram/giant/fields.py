"""Reading and writing of fields of fixed-column records: of one field, and of columns of many records.

Functions for the characters of one field raise ValueError; :mod:`photogram.giant.records` adds file, record
and columns. Rules: GIANT guide, section II.B. Plain fields, which are nearly all, are processed in arrays of
up to a million. Other fields to read (inner blanks, exponents, letters, 60 minutes) are read by
:class:`photogram.giant.records.Record`. Other numbers are written by `format_real` and `format_angle`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.arguments.types import Bools, Floats, Indices
from photogram.io.numbers import ARCSEC
from photogram.io.records import parse_real
from photogram.words import phrase

MOST_ANGLE = (360 * 3600 + 3599) * ARCSEC
"""Largest angle that is written, 360 59 59: a field may contain 360 degrees plus minutes."""

LARGEST_PACKED = 10**8  # Larger than every angle, and safe for decimal division


def parse_name(field: str, strip: str = "") -> str:
    """Read a name without the leading `strip` characters (COMMON column 15).

    A name that consists of this character is reduced to one of it, so that it is not empty.
    """
    name = field.strip(" ")
    if not strip or not name.startswith(strip):
        return name
    return name.lstrip(strip).lstrip(" ") or strip


def unpack_dms(packed: Decimal) -> tuple[int, int, int, Decimal]:
    """Split decimal DDDMMSS.sss into sign, degrees, minutes and seconds."""
    sign, value = (-1 if packed < 0 else 1), abs(packed)
    degrees, rest = divmod(value, 10000)
    minutes, seconds = divmod(rest, 100)
    return sign, int(degrees), int(minutes), seconds


def parse_angle(field: str, decimals: int) -> tuple[float, bool]:
    """Read a packed DMS field."""
    packed = parse_real(field, decimals)
    if abs(packed) > LARGEST_PACKED:
        raise ValueError(phrase("giant.dms", value=field.strip(), angle="beyond 360 degrees"))
    sign, degrees, minutes, seconds = unpack_dms(packed)
    if degrees > 360 or minutes > 60 or seconds > 60:
        angle = f"{degrees} degrees {minutes} minutes {seconds} seconds"
        raise ValueError(phrase("giant.dms", value=field.strip(), angle=angle))
    return sign * float(3600 * degrees + 60 * minutes + seconds) * ARCSEC, minutes == 60 or seconds == 60


def format_real(value: float, width: int, decimals: int) -> str:
    """Write a number for an Fw.d field with an explicit point, right-justified.

    A number that does not fit is rounded. It has at least `decimals` decimals if they fit. The implied point
    of the format is used only if the explicit one would cost a digit. NaN, an unknown value, is a blank
    field.
    """
    if math.isnan(value):
        return " " * width
    if math.isinf(value):
        raise ValueError(phrase("giant.not-finite", value=value))
    text = repr(value + 0.0)
    if "e" in text or len(text) > width:
        text = _rounded(value, width)
    whole, _, fraction = text.partition(".")
    if len(fraction) < decimals:
        implied = f"{value:.{decimals}f}"
        if float(implied) != float(text) and len(implied) - 1 <= width:
            return implied.replace(".", "").rjust(width)
    room = width - len(whole) - 1
    if room < 0:
        raise ValueError(phrase("giant.width", value=value, width=width))
    text = f"{whole}.{fraction.rstrip('0').ljust(min(decimals, room), '0')}"
    if text[0] == "-" and not text.strip("-.0"):
        text = text[1:]
    return (text.replace(".", "0.") if whole in ("", "-") and len(text) < width else text).rjust(width)


def _rounded(value: float, width: int) -> str:
    """Round to the decimals that fit; the result may be too long."""
    places, excess = width + 1, 1
    while excess > 0 and places > 0:
        places = max(0, places - excess)
        text = f"{value:#.{places}f}"
        if abs(value) < 1 and places:
            text = text.replace("0.", ".", 1)
        excess = len(text) - width
    return text


def format_angle(value: float, width: int) -> str:
    """Write radians as a packed DMS field with an explicit point, right-justified.

    An angle from such a field is written exactly; others to five decimals of the second, or four at the end
    of the columns. A negative angle that would lose the fourth decimal is increased by 360 degrees, which
    needs no sign. NaN, an unknown value, is a blank field.
    """
    if math.isnan(value):
        return " " * width
    text = _packed(value, width, least=4)
    if parse_angle(text, 0)[0] != value:
        text = _packed(value, width, least=4, most=5)
        if value < 0 and len(text) - 1 - text.index(".") < 4:
            return format_angle(value + 2 * math.pi, width)
    return text.rjust(width)


def _packed(value: float, width: int, *, least: int, most: int = 12) -> str:
    """Write radians as packed DMS with `least` to `most` decimals."""
    if not abs(value) <= MOST_ANGLE:
        raise ValueError(phrase("giant.angle", value=value))
    arcseconds = Decimal(repr(float(value) / ARCSEC))
    places, excess = min(most, width - 2) + 1, 1
    while excess > 0 and places > 0:
        places = max(0, places - excess)
        rounded = round(arcseconds, places)
        whole_minutes, seconds = divmod(abs(rounded), 60)
        degrees, minutes = divmod(int(whole_minutes), 60)
        packed = f"{'-' if rounded < 0 else ''}{10000 * degrees + 100 * minutes + seconds:f}"
        whole, _, fraction = packed.partition(".")
        excess = len(whole) + 1 + places - width
    if excess > 0:
        raise ValueError(phrase("giant.width", value=f"{value} rad", width=width))
    return f"{whole}.{fraction.rstrip('0').ljust(min(least, places), '0')}"


def format_name(name: str) -> str:
    """Write a name of at most eight characters into its eight columns."""
    if len(name) > 8:
        raise ValueError(phrase("giant.name-length", name=name))
    if name != name.strip(" ") or not name.isprintable() or name.startswith("****"):
        raise ValueError(phrase("giant.name", name=name))
    return name.ljust(8)


def printed_order(name: str) -> tuple[int, str]:
    """Return the sort key of the program: right-justified names.

    A blank precedes every first character of a name, so shorter names are first.
    """
    return len(name), name


def format_principal_distance(value: float) -> str:
    """Write a principal distance (F10.3); zero, the default of the camera, is blank."""
    if value == 0:
        return " " * 10
    field = format_real(value, 10, 3)
    if not _significant(field):
        raise ValueError(phrase("giant.width", value=value, width=10))
    return field


def _significant(field: str) -> bool:
    return any(digit in field for digit in "123456789")


def format_deviations(values: Iterable[float], angles: Iterable[bool]) -> str:
    """Write standard deviations, F10.3 or DMS; zero, the default, is blank."""
    fields = []
    for value, angle in zip(values, angles, strict=True):
        if value == 0:
            fields.append(" " * 10)
            continue
        field = _packed(value, 10, least=3).rjust(10) if angle else format_real(value, 10, 3)
        if not value > 0 or not _significant(field):
            raise ValueError(phrase("giant.width", value=value, width=10))
        fields.append(field)
    return "".join(fields)


Table = NDArray[np.uint8]

POWERS = 10 ** np.arange(19, dtype=np.int64)
BLANK, POINT, MINUS, ZERO = b" .-0"
RUN = 1 << 16  # Number of values per run
TIE = 1e-4
"""Numbers this close (in units of the last decimal) to the middle between two texts are rounded in decimal.

Below 1e12 units, the range of twelve columns, a product with a power of ten has a smaller error.
"""


class Columns:
    """The columns `first` to `last` of many records.

    Attributes
    ----------
    plain
        (n,) which records had only plain fields so far; values of the others are undefined.
    """

    def __init__(self, records: Sequence[str], first: int = 1, last: int = 80) -> None:
        width = last - first + 1
        text = "".join([record[first - 1 : last].ljust(width) for record in records])
        characters = np.frombuffer(text.encode("ascii", "replace"), dtype=np.uint8)
        self._table = characters.reshape(len(records), width)
        self._first = first
        self.plain = np.ones(len(records), dtype=bool)

    def blank(self, first: int, last: int) -> Bools:
        blank: Bools = (self._field(first, last) == BLANK).all(axis=1)
        return blank

    def real(self, first: int, last: int, decimals: int = 3) -> Floats:
        """Read Fw.d fields; blank is zero."""
        negative, digits, places = self._number(first, last, decimals)
        # Twelve digits and a power of ten are exact, so the quotient is the nearest number to the text.
        size: Floats = digits / POWERS[places]
        return np.where(negative, -size, size)

    def angle(self, first: int, last: int, decimals: int = 3) -> Floats:
        """Read packed DMS fields as radians."""
        negative, digits, places = self._number(first, last, decimals)
        unit = POWERS[places]
        minutes, seconds = np.divmod(digits, 100 * unit)
        degrees, minutes = np.divmod(minutes, 100)
        self.plain &= (degrees <= 360) & (minutes < 60) & (seconds < 60 * unit)
        size: Floats = ((3600 * degrees + 60 * minutes) * unit + seconds) / unit * ARCSEC
        return np.where(negative & (digits > 0), -size, size)

    def deviation(self, first: int, last: int, *, angle: bool = False) -> Floats:
        """Read standard deviations; zero means the default."""
        values = self.angle(first, last) if angle else self.real(first, last)
        # Smaller angles could not be written again.
        self.plain &= (values == 0) | (values > (1e-8 * ARCSEC if angle else 0))
        return values

    def position(self, geographic: bool) -> Floats:
        """Read columns 9-44 (F12.3) as (n, 3): X, Y, Z, or geographic (rad)."""
        if not geographic:
            return np.column_stack([self.real(9, 20), self.real(21, 32), self.real(33, 44)])
        longitude, latitude, height = self.angle(9, 20), self.angle(21, 32), self.real(33, 44)
        self.plain &= np.abs(latitude) <= math.pi / 2
        return np.column_stack([longitude, latitude, height])

    def deviations(self, *angles: bool) -> Floats:
        """Read columns 45-74 as (n, 3) standard deviations; `angles` selects DMS fields."""
        fields = zip((45, 55, 65), angles, strict=True)
        return np.column_stack([self.deviation(first, first + 9, angle=angle) for first, angle in fields])

    def attitude(self) -> Floats:
        """Read columns 9-44 as (n, 3) omega, phi and kappa in radians."""
        return np.column_stack([self.angle(first, first + 11) for first in (9, 21, 33)])

    def rows(self, *values: Floats) -> list[tuple[Any, ...] | None]:
        """Return (n, k) arrays as rows, None for records that are not plain."""
        rows = zip(*(zip(*array.T.tolist(), strict=True) for array in values), strict=True)
        return [row if plain else None for row, plain in zip(rows, self.plain.tolist(), strict=True)]

    def _field(self, first: int, last: int) -> Table:
        return self._table[:, first - self._first : last - self._first + 1]

    def _number(self, first: int, last: int, decimals: int) -> tuple[Bools, Indices, Indices]:
        """Read sign, digits as an integer, and number of decimals."""
        field = self._field(first, last)
        negative = np.zeros(len(field), dtype=bool)
        begun, ended, after_point = negative.copy(), negative.copy(), negative.copy()
        digits = np.zeros(len(field), dtype=np.int64)
        count, places = digits.copy(), digits.copy()
        for character in field.T:
            digit = character - np.uint8(ZERO)  # Wraps around below "0"
            is_digit = digit < 10
            is_point, is_blank = character == POINT, character == BLANK
            is_sign = (character == MINUS) | (character == ord("+"))
            legal = is_blank | ((is_digit | (is_point & ~after_point) | (is_sign & ~begun)) & ~ended)
            self.plain &= legal
            negative |= character == MINUS
            ended |= is_blank & begun
            begun |= ~is_blank
            after_point |= is_point
            digits = np.where(is_digit, 10 * digits + digit, digits)
            count += is_digit
            places += is_digit & after_point
        self.plain &= (count > 0) | ~begun
        return negative, digits, np.where(after_point, places, decimals)


def real_fields(values: ArrayLike, width: int, decimals: int) -> Table:
    """Write numbers (n, k) to Fw.d fields; see `format_real`.

    Returns (n, k width) characters, at most 12 per field. Raises ValueError if a number is infinite or too
    large for the field.
    """
    return _in_runs(values, width, lambda run: _reals(run, width, decimals))


def _reals(values: Floats, width: int, decimals: int) -> Table:
    negative, size = values < 0, np.abs(values)
    whole = np.searchsorted(POWERS[:width], size, side="right")
    places = width - 1 - negative - whole
    plain = np.isfinite(values) & (places >= decimals)
    units, tied = _rounded_units(np.where(plain, size, 0.0), np.where(plain, places, decimals))
    units, places = _fitting(units, places, whole + places)
    table = _characters(negative, units, places, decimals, width)
    return _with_others(table, values, plain & ~tied, lambda value: format_real(value, width, decimals))


def angle_fields(values: ArrayLike, width: int) -> Table:
    """Write radians (n, k) to packed DMS fields; see `format_angle`.

    Returns (n, k width) characters, at most 12 per field. Raises ValueError if an angle exceeds 360 degrees.
    """
    return _in_runs(values, width, lambda run: _angles(run, width))


def _angles(values: Floats, width: int) -> Table:
    negative, size = values < 0, np.abs(values)
    plain = size <= MOST_ANGLE
    seconds = np.where(plain, size, 0.0) / ARCSEC
    room = width - 1 - negative
    whole = np.searchsorted(
        POWERS[:width], _packed_units(seconds.astype(np.int64), np.zeros_like(room)), side="right"
    )
    places = room - np.maximum(whole, 1)
    units, _ = _rounded_units(seconds, places)
    exact = units / POWERS[places] * ARCSEC == size
    five = np.minimum(places, 5)
    rounded, tied = _rounded_units(seconds, five)
    places = np.where(exact, places, five)
    units, places = _fitting(_packed_units(np.where(exact, units, rounded), places), places, room)
    table = _characters(negative, units, places, 4, width)
    unsigned = plain & negative & (places < 4) & ~exact
    if unsigned.any():
        table[unsigned] = _angles(values[unsigned] + 2 * math.pi, width)
    plain &= exact | ~tied
    return _with_others(table, values, plain | unsigned, lambda value: format_angle(value, width))


def position_fields(positions: ArrayLike, geographic: bool) -> Table:
    """Write (n, 3) coordinates (F12.3): X, Y, Z, or geographic (rad).

    Returns (n, 36) characters.
    """
    positions = np.asarray(positions, dtype=np.float64).reshape(-1, 3)
    if not geographic:
        return real_fields(positions, 12, 3)
    return np.hstack([angle_fields(positions[:, :2], 12), real_fields(positions[:, 2:], 12, 3)])


def deviation_fields(deviations: Sequence[tuple[float, ...]], angles: Sequence[bool]) -> list[str]:
    """Write standard deviations of records; see `format_deviations`."""
    # A file has few different ones.
    different = {values: format_deviations(values, angles) for values in set(deviations)}
    return [different[values] for values in deviations]


def texts(table: Table) -> list[str]:
    """Return the rows of a table of characters."""
    width = table.shape[1]
    text = table.tobytes().decode("ascii")
    return [text[start : start + width] for start in range(0, len(text), width)]


def _in_runs(values: ArrayLike, width: int, write: Callable[[Floats], Table]) -> Table:
    """Write (n, k) values as (n, k width) characters, in cached runs."""
    values = np.asarray(values, dtype=np.float64)
    flat = values.ravel()
    table = np.empty((len(flat), width), dtype=np.uint8)
    for start in range(0, len(flat), RUN):
        table[start : start + RUN] = write(flat[start : start + RUN])
    return table.reshape(len(values), values.shape[1] * width)


def _rounded_units(values: Floats, places: Indices) -> tuple[Indices, Bools]:
    """Round to units of the last decimal; return which are undecided."""
    scaled = values * POWERS[places]
    units = np.rint(scaled)
    return units.astype(np.int64), np.abs(scaled - units) > 0.5 - TIE


def _fitting(units: Indices, places: Indices, room: Indices) -> tuple[Indices, Indices]:
    """Omit the last decimal, a zero, if rounding produced one digit too many."""
    carried = (units >= POWERS[np.clip(room, 0, 18)]) & (places > 0)
    return np.where(carried, units // 10, units), places - carried


def _packed_units(units: Indices, places: Indices) -> Indices:
    """Convert seconds of arc to DDDMMSS, units of the last decimal."""
    unit = POWERS[places]
    minutes, seconds = np.divmod(units, 60 * unit)
    degrees, minutes = np.divmod(minutes, 60)
    packed: Indices = (10000 * degrees + 100 * minutes) * unit + seconds
    return packed


def _characters(negative: Bools, units: Indices, places: Indices, least: int, width: int) -> Table:
    """Write units of the last decimal with an explicit point, right-justified.

    Trailing zeros are removed down to `least` decimals, the zero before the point only if the field is too
    narrow.
    """
    units, places = units.copy(), places.copy()
    rows = np.flatnonzero(places > least)
    while rows.size:
        rows = rows[units[rows] % 10 == 0]
        units[rows] //= 10
        places[rows] -= 1
        rows = rows[places[rows] > least]
    negative = negative & (units > 0)
    table = np.full((width, len(units)), BLANK, dtype=np.uint8)
    signed = ~negative
    for place, column in enumerate(table[::-1]):
        # The index counts from the right and includes the point.
        units_left = np.where(place == places, units, units // 10)
        first_whole = (place == places + 1) & (place + negative < width)
        is_digit = (place != places) & ((units > 0) | (place < places) | first_whole)
        column[is_digit] = (units - 10 * units_left + ZERO)[is_digit]
        column[place == places] = POINT
        sign = ~signed & ~is_digit & (place > places)
        column[sign] = MINUS
        signed |= sign
        units = units_left
    return np.ascontiguousarray(table.T)


def _with_others(table: Table, values: Floats, plain: Bools, write: Callable[[float], str]) -> Table:
    """Write the values that are not plain one by one."""
    for row in np.flatnonzero(~plain).tolist():
        table[row] = np.frombuffer(write(float(values[row])).encode("ascii"), dtype=np.uint8)
    return table
