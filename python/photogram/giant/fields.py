"""Reading and writing of single fields of fixed-column records.

Functions process the characters of one field and raise ValueError; :mod:`photogram.giant.records` adds file,
record and columns. Rules: GIANT guide, section II.B.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from decimal import Decimal

from photogram.io.angles import ARCSEC
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
