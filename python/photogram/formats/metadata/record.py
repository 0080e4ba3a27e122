"""Positions of photos by one source each: `Said`, files `.MRK` of DJI, and events of RTKLIB."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import datetime
from itertools import islice
from pathlib import Path

import numpy as np

from photogram.io.files import read_lines
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass
from photogram.network.geometry import Spheroid, geocentric_to_geographic, lengths_of_units, local_frames
from photogram.words import phrase

Triple = tuple[float, float, float]

ELLIPSOIDAL = "EPSG:4979"  # Longitude and latitude of WGS 84, heights above its ellipsoid
UNSAID_SYSTEM = "EPSG:4326"  # Longitude and latitude of WGS 84, where nothing says what heights are above

UNSAID, SEA_LEVEL = "unsaid", "above sea level"
"""Heights of which the source does not say what they are above; and those of which it does, but not where the
geoid is."""

FIXED = "fixed"
HIGHEST = 1e5  # Metres that a height, or a standard deviation, may be at most
LEAST = 1e-6  # Metres that a standard deviation is at least


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
        raise place.error(phrase("photos.degrees", longitude=longitude, latitude=latitude))
    if abs(height) > HIGHEST:
        raise place.error(phrase("photos.height", height=height, most=HIGHEST))
    return None if longitude == 0 and latitude == 0 else (longitude, latitude, height)


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
            raise each.place.error(phrase("format.repeated", what="exposure", name=str(each.number)))
        found[each.number] = each
    return found


def _exposure(place: Place) -> Exposure:
    cells = [each.strip() for each in (place.text or "").split("\t")]
    if len(cells) < 11:
        raise place.error(phrase("format.words", n=len(cells), required="11 words between tabs"))
    number, seconds, week, *rest = cells
    if not (week.startswith("[") and week.endswith("]")):
        raise place.error(phrase("photos.week", value=week))
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
        raise place.error(phrase("format.member", name=missing[0]))
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


SOURCE = "RTKLIB"
SECONDS_OF_WEEK = 604_800
HEADER_LINES = 60
_COMMENT = "%"
_FLAGS = {1: 50, 2: 34, 5: 16}  # Quality of RTKLIB as the flag of DJI: fixed, float, single
_WORDS = re.compile(r"[,;\s]+")
_EPOCH = datetime(1980, 1, 6)


@dataclass(frozen=True)
class Event:
    """The time of an exposure in seconds since the first GPS week, and its position."""

    seconds: float
    said: Said


def is_events(path: Path) -> bool:
    """Whether a text file has the header of RTKLIB's solutions."""
    return any(_is_header(line) for line in islice(read_lines(path), HEADER_LINES))


def _is_header(line: str) -> bool:
    return line.startswith(_COMMENT) and ("latitude(" in line or "x-ecef(" in line or "e-baseline(" in line)


def read_events(path: Path) -> list[Event]:
    """Read the events of a file in order of time."""
    head, heights, events = Place(path), "", list[Event]()
    for record, line in enumerate(read_lines(path), 1):
        if line.startswith(_COMMENT):
            heights = SEA_LEVEL if "/geodetic" in line else heights
            head = Place(path, record, line) if _is_header(line) else head
        elif line.strip():
            events.append(_event(Place(path, record, line), head, heights))
    if not events:
        raise head.error(phrase("format.missing", what="events of RTKLIB"))
    return sorted(events, key=lambda event: event.seconds)


def _event(place: Place, head: Place, heights: str) -> Event:
    columns = head.text or ""
    if "e-baseline(" in columns:
        raise head.error(phrase("photos.baselines"))
    geocentric = "x-ecef(" in columns
    words = _WORDS.split((place.text or "").strip())
    size = 3 if "latitude(d'" in columns else 1
    least, names = 2 * size + 8, "latitude, longitude, height, Q, ns, sdn, sde, sdu"
    if geocentric:
        least, names = 13, "x, y, z, Q, ns, sdx, sdy, sdz, sdxy, sdyz, sdzx"
    if len(words) < least:
        raise place.error(phrase("format.words", n=len(words), required=f"date, time, {names}"))
    count = 3 if geocentric else 2 * size + 1
    *first, last = words[2 : 2 + count]
    quality, _, *rest = words[2 + count :]
    deviations = [place.number(word, "standard deviation") for word in rest[: 6 if geocentric else 3]]
    if geocentric:
        xyz = [place.number(word, "coordinate") for word in (*first, last)]
        position, (east, north, up) = _geographic(xyz, deviations)
    else:
        latitude, longitude = (_degrees(first[k : k + size], place) for k in (0, size))
        position = longitude, latitude, place.number(last, "height")
        north, east, up = deviations
    return Event(
        _seconds(words[:2], place),
        Said(
            SOURCE,
            place,
            ELLIPSOIDAL,
            "" if geocentric else heights,
            geographic_position(place, position),
            usable_deviations(east, north, up),
            rtk=True,
            flag=_FLAGS.get(place.whole(quality, "Q", highest=9)),
        ),
    )


def _geographic(xyz: Sequence[float], deviations: Sequence[float]) -> tuple[Triple, Triple]:
    """Return longitude, latitude, height and standard deviations of east, north, up; 0, 0, 0 stays.

    `deviations` are those of X, Y, Z, and the roots of the covariances XY, YZ, ZX with their signs.
    """
    if not any(xyz):
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    [place] = geocentric_to_geographic([xyz], Spheroid.wgs84())
    xx, yy, zz, xy, yz, zx = (value * abs(value) for value in deviations)
    [axes] = local_frames([place])
    turned = axes @ np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) @ axes.T
    longitude, latitude = np.degrees(place[:2]).tolist()
    east, north, up = np.sqrt(np.maximum(np.diagonal(turned), 0.0)).tolist()
    return (longitude, latitude, float(place[2])), (east, north, up)


def _degrees(words: Sequence[str], place: Place) -> float:
    """Return an angle in degrees from one word, or from degrees, minutes and seconds."""
    size = sum(abs(place.number(word, "angle")) / 60.0**k for k, word in enumerate(words))
    return math.copysign(size, -1.0 if words[0].startswith("-") else 1.0)


def _seconds(words: Sequence[str], place: Place) -> float:
    """Return seconds since the first GPS week from a date and a time, or from a week and its seconds."""
    if "/" not in words[0]:
        return place.whole(words[0], "week", highest=10**5) * SECONDS_OF_WEEK + place.number(
            words[1], "seconds"
        )
    try:
        time = datetime.strptime(f"{words[0]} {words[1].partition('.')[0]}", "%Y/%m/%d %H:%M:%S")
    except ValueError:
        raise place.error(phrase("photos.time", value=" ".join(words))) from None
    return (time - _EPOCH).total_seconds() + place.number(f"0.{words[1].partition('.')[2] or 0}", "time")
