"""`*_Timestamp.MRK` of DJI: a line an exposure, with the position of the camera and its accuracy."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from photogram.formats.metadata.record import (
    ELLIPSOIDAL,
    Said,
    Triple,
    fix_of,
    geographic_position,
    usable_deviations,
)
from photogram.io.files import read_lines
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass
from photogram.messages import quoted
from photogram.network.geometry import Spheroid, lengths_of_units

_NUMBER = re.compile(r"(?<!\d)\d{4}(?!\d)")
_NAME = re.compile(r"(.*?)_?Timestamp", re.IGNORECASE)
_NAMED = ("N", "E", "V", "Lat", "Lon", "Ellh", "Q")
LARGEST_FLAG = 1000


@dataclass(frozen=True)
class Exposure:
    """A line of a file: an exposure by its number, from 1, and when it was, in seconds of a week of GPS.

    `offset` leads from the antenna to the camera: north, east, down, metres; `position` is longitude,
    latitude (degrees) and height above the ellipsoid, of the camera; `sd` are those of east, north and
    height, metres; `flag` is that of the solution, as `fix_of` knows it.
    """

    number: int
    gps_seconds: float
    week: int
    offset: Triple
    position: Triple | None
    sd: Triple | None
    flag: int
    place: Place

    def said(self, antenna: bool) -> Said:
        """Return what the line says of its photo; `antenna`: its position is that of the antenna."""
        position = self.position
        if antenna and position is not None:
            position = _moved(position, self.offset)
        rtk = fix_of(self.flag) != "none"
        return Said(".MRK", self.place, ELLIPSOIDAL, "", position, self.sd, rtk, self.flag)


def _moved(position: Triple, offset: Triple) -> Triple:
    """Return a position moved north, east and down by metres."""
    longitude, latitude, height = position
    known = np.array([[math.radians(longitude), math.radians(latitude), height]])
    lengths = lengths_of_units(known, Spheroid.wgs84())[0]
    north, east, down = offset
    return (
        longitude + math.degrees(east / float(lengths[0])),
        latitude + math.degrees(north / float(lengths[1])),
        height - down,
    )


def number_of(stem: str) -> int | None:
    """Return the number of an exposure from the name of its photo: `DJI_0042`, `..._0042_V`; None without."""
    found = _NUMBER.findall(stem)
    return int(found[-1]) if found else None


def prefix_of(path: Path) -> str:
    """Return what the photos of a file are called before their numbers, if they are called as it is."""
    match = _NAME.match(path.stem)
    return match[1] if match else path.stem


def read_exposures(path: Path) -> dict[int, Exposure]:
    """Read a file; return its exposures by their numbers.

    Section 6 of the specification: tabs between number, seconds of the week, `[week]`, `dN,N`, `dE,E`, `dV,V`
    in millimetres, `lat,Lat`, `lon,Lon`, `h,Ellh`, `sN, sE, sV` in metres, and `flag,Q`.
    """
    found: dict[int, Exposure] = {}
    for record, line in enumerate(read_lines(path), 1):
        if not line.strip():
            continue
        each = _exposure(Place(path, record, line))
        if each.number in found:
            first = found[each.number].place.record
            raise each.place.error(f"the exposure {each.number} is there already, in record {first}")
        found[each.number] = each
    return found


def _exposure(place: Place) -> Exposure:
    cells = [each.strip() for each in (place.text or "").split("\t")]
    if len(cells) < 11:
        raise place.error(f"has {len(cells)} cells between tabs: 11 make an exposure")
    number, seconds, week, *rest = cells
    if not (week.startswith("[") and week.endswith("]")):
        raise place.error(f"{quoted(week)} is no week of GPS in brackets")
    named: dict[str, str] = {}
    accuracies: list[str] = []
    for cell in rest:
        parts = [each.strip() for each in cell.split(",")]
        if len(parts) == 2 and parts[1] in _NAMED:
            named[parts[1]] = parts[0]
        elif len(parts) == 3:
            accuracies = parts
    missing = [each for each in _NAMED if each not in named] + ([] if accuracies else ["sN, sE, sV"])
    if missing:
        raise place.error(f"has no {missing[0]}")
    north, east, up = (place.number(each, "standard deviation") for each in accuracies)
    flag = place.whole(named["Q"], "Q", highest=LARGEST_FLAG)
    offset = [place.number(named[each], each) / 1000 for each in ("N", "E", "V")]
    position = geographic_position(
        place, [place.number(named[each], each) for each in ("Lon", "Lat", "Ellh")]
    )
    return Exposure(
        place.whole(number, "number", highest=10**6),
        place.number(seconds, "seconds"),
        place.whole(week[1:-1].strip(), "week", highest=10**5),
        (offset[0], offset[1], offset[2]),
        position,
        usable_deviations(east, north, up) if flag else None,
        flag,
        place,
    )
