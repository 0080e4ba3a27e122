"""Angles in degrees, minutes and seconds."""

from __future__ import annotations

import math

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
