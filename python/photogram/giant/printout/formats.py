"""Numbers of the printout: the edit descriptors of its FORMAT statements, as the sample shows them."""

from __future__ import annotations

import math
from collections.abc import Iterable

from photogram.lazy_dataclasses import dataclass
from photogram.show.angles import degrees_minutes_seconds

__all__ = ["VALUE", "Space", "attitude", "attitude_name", "dms", "exponential", "fixed"]

VALUE = 15
"""Columns of a value: sign, degrees, minutes and seconds (A1, I3, I3, F8.4), or a length as wide as that."""

UNITS = {"m": "METERS", "ft": "FEET"}

Values = Iterable[float]


def fixed(value: float, width: int, decimals: int) -> str:
    """Write a number as Fw.d; NaN is blank, zero has no sign, one that is too long gets the room it needs."""
    text = "" if math.isnan(value) else f"{value:.{decimals}f}"
    return (text.removeprefix("-") if text.strip("-0.") == "" else text).rjust(width)


def exponential(value: float) -> str:
    """Write a number as E10.3: `0.377E-13`; NaN is blank."""
    if math.isnan(value):
        return " " * 10
    mantissa, _, power = f"{value + 0.0:.2e}".partition("e")
    exponent = int(power) + 1 if value else 0
    # An exponent of three digits takes the place of the letter.
    shown = f"E{exponent:+03d}" if abs(exponent) < 100 else f"{exponent:+04d}"
    sign = "-" if value < 0 else ""
    return f"{sign}0.{mantissa.lstrip('-').replace('.', '')}{shown}".rjust(10)


def dms(angle: float, *, circle: bool = False) -> str:
    """Write radians as sign, degrees, minutes, seconds (A1, I3, I3, F8.4); NaN is blank, zero has no sign.

    `circle` brings 360 degrees, which rounding may make of a little less, to zero.
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
    """Name the sense of the angles as the headings do."""
    return "PHOTO TO GROUND" if photo_to_ground else "GROUND TO PHOTO"


@dataclass(frozen=True)
class Space:
    """How coordinates of the object space are named and written.

    Attributes
    ----------
    geographic
        Longitude, latitude and elevation, or X, Y and Z.
    unit
        The linear unit, as a block names it.
    """

    geographic: bool
    unit: str = "m"

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
        """Write three coordinates, or differences or deviations of them; lengths with so many decimals."""
        first, second, third = position
        planimetry = (
            [dms(first), dms(second)]
            if self.geographic
            else [fixed(first, VALUE, decimals), fixed(second, VALUE, decimals)]
        )
        return [*planimetry, fixed(third, VALUE, decimals)]
