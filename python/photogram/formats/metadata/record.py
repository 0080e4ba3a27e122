"""What one source says of where a photo was taken, and how well."""

from __future__ import annotations

import math
from collections.abc import Sequence

from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass

__all__ = [
    "ELLIPSOIDAL",
    "FIXED",
    "SEA_LEVEL",
    "UNSAID",
    "UNSAID_SYSTEM",
    "Said",
    "Triple",
    "fix_of",
    "geographic_position",
    "usable_deviations",
]

Triple = tuple[float, float, float]

ELLIPSOIDAL = "EPSG:4979"
"""Longitude and latitude of WGS 84, heights above its ellipsoid."""
UNSAID_SYSTEM = "EPSG:4326"
"""Longitude and latitude of WGS 84, where nothing says what heights are above."""

UNSAID, SEA_LEVEL = "unsaid", "above sea level"
"""Heights of which the source does not say what they are above; and those of which it does, but not where the
geoid is."""

FIXED = "fixed"
HIGHEST = 1e5
"""Metres that a height, or a standard deviation, may be at most."""
LEAST = 1e-6
"""Metres that a standard deviation is at least."""


@dataclass(frozen=True)
class Said:
    """What one source says of one photo.

    Attributes
    ----------
    source
        `geo.txt`, `reference`, `.MRK`, `XMP` or `EXIF`.
    place
        Where it stands, for errors and remarks.
    crs
        The system of the position; empty where the source does not say it.
    heights
        Empty: those of the system; else :data:`UNSAID` or :data:`SEA_LEVEL`.
    position
        Longitude (degrees) or easting, latitude or northing, height; the height is NaN without one. None: the
        source has no position.
    sd
        Standard deviations of east, north and height, metres; None without usable ones.
    rtk
        Whether they are internal ones of a receiver with corrections in real time.
    flag, fix
        What DJI writes of the solution, and what it means: `fixed`, `float`, `single`, `none`, `unknown`;
        empty where the source has no word for it.
    angles
        Three angles in degrees as the source has them (yaw, pitch, roll); they are no observations.
    remark
        What is to be said of all photos with such a source, if anything.
    """

    source: str
    place: Place
    crs: str = ""
    heights: str = ""
    position: Triple | None = None
    sd: Triple | None = None
    rtk: bool = False
    flag: int | None = None
    angles: Triple | None = None
    remark: str = ""

    @property
    def fix(self) -> str:
        """What the flag means."""
        return fix_of(self.flag) if self.rtk or self.flag is not None else ""

    @property
    def is_located(self) -> bool:
        """Whether there is a position with a height."""
        return self.position is not None and not math.isnan(self.position[2])


def fix_of(flag: int | None) -> str:
    """Return what a flag of DJI means (`RtkFlag` of XMP, `Q` of .MRK; section 6 of the specification)."""
    if flag is None:
        return "unknown"
    if 50 <= flag <= 59:
        return FIXED
    return {34: "float", 16: "single", 0: "none"}.get(flag, "unknown")


def usable_deviations(east: float, north: float, height: float) -> Triple | None:
    """Return standard deviations; None where one of them is not positive or not there (NaN).

    A receiver without a solution writes 0: that is no accuracy, nor is what no receiver has.
    """
    found = (east, north, height)
    return found if all(LEAST <= each <= HIGHEST for each in found) else None


def geographic_position(place: Place, values: Sequence[float]) -> Triple | None:
    """Return longitude, latitude (degrees) and height of a source; None for 0, 0, which is no position."""
    longitude, latitude, height = values
    if not (abs(longitude) <= 180 and abs(latitude) <= 90):
        raise place.error(f"{longitude!r}, {latitude!r} is no longitude and latitude in degrees")
    if abs(height) > HIGHEST:
        raise place.error(f"{height!r} is no height of a photo in metres")
    return None if longitude == 0 and latitude == 0 else (longitude, latitude, height)
