"""Numbers in fields of fixed columns, read by the rules of FORTRAN."""

from __future__ import annotations

import math
import re
from decimal import Decimal

__all__ = ["parse_integer", "parse_real"]

LARGEST_EXPONENT = 400
"""Beyond every number in double precision, digits before and after the point included."""

_REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[EeDd]([+-]?\d+)|([+-]\d+))?", re.ASCII)
_INTEGER = re.compile(r"[+-]?\d+", re.ASCII)


def parse_real(field: str, decimals: int) -> Decimal:
    """Read an Fw.d field exactly (FORTRAN 77, ANSI X3.9-1978, 13.5.9.2.1).

    A blank field is zero, blanks inside are ignored (BLANK='NULL'), and without a decimal point the last
    `decimals` digits are the fraction. An exponent follows E or D, with or without a sign, or is a sign and
    digits without a letter: `1.5+2` is 150. NaN and infinity have no spelling.

    Raises
    ------
    ValueError
        The field is no number, or one that double precision does not have.
    """
    digits = field.replace(" ", "")
    if not digits:
        return Decimal(0)
    match = _REAL.fullmatch(digits)
    if match is None:
        raise ValueError(f"{field!r} is not a number")
    mantissa, lettered, bare = match.groups()
    value, exponent = Decimal(mantissa), int(lettered or bare or 0)
    if not value:
        return value
    exponent = max(-LARGEST_EXPONENT, min(exponent, LARGEST_EXPONENT))
    value = value.scaleb(exponent - (0 if "." in mantissa else decimals))
    if math.isinf(float(value)) or float(value) == 0:
        raise ValueError(f"{field!r} is beyond the range of numbers")
    return value


def parse_integer(field: str) -> int:
    """Read an Iw field; blank is zero and blanks inside are ignored."""
    digits = field.replace(" ", "")
    if digits and _INTEGER.fullmatch(digits) is None:
        raise ValueError(f"{field!r} is not a whole number")
    return int(digits or 0)
