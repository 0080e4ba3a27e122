"""Numbers in text files: one strict spelling for tables, settings and names of plates."""

from __future__ import annotations

import math
import re

from photogram.messages import quoted

__all__ = ["LARGEST_INTEGER", "finite_number", "is_whole_number", "whole_number"]

LARGEST_INTEGER = 2**63 - 1
"""The largest that an array of 64-bit integers holds."""

LONGEST = 1_000
"""Characters of a number at most: 767 digits tell any two numbers of double precision apart."""

_WHOLE = re.compile(r"\+?[0-9]+")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def is_whole_number(text: str) -> bool:
    """Whether a text is digits 0 to 9 and nothing else; other alphabets, superscripts and signs are not."""
    return text.isascii() and text.isdigit()


def whole_number(text: str, lowest: int = 0, highest: int = LARGEST_INTEGER) -> int:
    """Read a whole number that is not negative.

    Parameters
    ----------
    text
        Its digits.
    lowest, highest
        What it may be.

    Raises
    ------
    ValueError
        It is no such number; the message shows the text, shortened.
    """
    if len(text) > LONGEST or not _WHOLE.fullmatch(text):
        raise ValueError(f"{quoted(text)} is not a whole number")
    value = int(text)
    if not lowest <= value <= highest:
        raise ValueError(f"{quoted(text)} is not from {lowest} to {highest}")
    return value


def finite_number(text: str) -> float:
    """Read a number in decimal digits, with an exponent or without.

    What Python reads besides is refused: NaN and infinity, `1_000`, digits of other alphabets, and numbers
    beyond double precision.

    Raises
    ------
    ValueError
        It is no such number; the message shows the text, shortened.
    """
    value = float(text) if len(text) <= LONGEST and _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise ValueError(f"{quoted(text)} is not a number")
    return value
