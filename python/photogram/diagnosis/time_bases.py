"""Differences between scales of time, and what they are called."""

from __future__ import annotations

from collections.abc import Iterator

__all__ = ["differences", "named"]

LEAPS = range(13, 19)
"""GPS - UTC in seconds from 1999 on; 18 since 2017."""
TAI_GPS, ET_TAI = 19.0, 32.184
"""TAI - GPS and ET - TAI, seconds; ET is that of SPICE, but for 2 ms."""
WITHIN = 0.010
"""Seconds: a shift of time this near to a difference is that."""


def differences() -> Iterator[tuple[str, str, float]]:
    """Return two scales and by how many seconds the first is ahead of the second."""
    yield "TAI", "GPS", TAI_GPS
    yield "ET", "TAI", ET_TAI
    yield "ET", "GPS", TAI_GPS + ET_TAI
    for leap in reversed(LEAPS):
        yield "GPS", "UTC", float(leap)
        yield "TAI", "UTC", leap + TAI_GPS
        yield "ET", "UTC", leap + TAI_GPS + ET_TAI


def named(shift: float) -> str:
    """Return the two scales whose difference is a shift of time in seconds; nothing where there are none.

    The shift is what times of the one lack to be times of the other.
    """
    found = []
    for ahead, behind, seconds in differences():
        for sign, of, to in ((1, behind, ahead), (-1, ahead, behind)):
            if abs(shift - sign * seconds) < WITHIN:
                found.append(f"{to} - {of} ({sign * seconds:+g} s)")
    return " or ".join(found)
