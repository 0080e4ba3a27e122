"""Positions of photos: class `Said`, and its text files: `.MRK`, events of RTKLIB, `geo.txt`, references."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from photogram.formats.cards import filled_lines
from photogram.formats.column_words import column_of, is_photo
from photogram.formats.columns import PLAIN, is_geographic, settled
from photogram.formats.control import system_of
from photogram.formats.plain.schema import AXES, TABLES, column_units, deviation_columns
from photogram.io.delimited import read_columns, read_rows
from photogram.io.files import read_lines
from photogram.io.numbers import finite_number
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.geometry import Spheroid, geocentric_to_geographic, lengths_of_units, local_frames
from photogram.words import phrase

ENDINGS = (".jpg", ".jpeg", ".tif", ".tiff", ".dng")  # Image files
Triple = tuple[float, float, float]

ELLIPSOIDAL = "EPSG:4979"  # Longitude and latitude of WGS 84, ellipsoidal heights
UNSAID_SYSTEM = "EPSG:4326"  # Longitude and latitude of WGS 84, heights of unknown reference

UNSAID, SEA_LEVEL = "unsaid", "above sea level"
"""Heights whose reference is unknown; and heights above sea level with an unknown geoid."""

FIXED, _FIXES = "fixed", {34: "float", 16: "single", 0: "none"}
"""Meanings of the flags of DJI (`RtkFlag` of XMP, `Q` of .MRK) from 50 to 59, and of others."""
HIGHEST = 1e5  # Largest height or standard deviation, metres
LEAST = 1e-6  # Smallest standard deviation, metres


@dataclass(frozen=True)
class Said:
    """Position and accuracy of one photo from one source.

    Attributes
    ----------
    source
        `geo.txt`, `reference`, `.MRK`, `XMP` or `EXIF`.
    place
        Location in the file, for errors and remarks.
    crs
        System of the position; empty if unknown.
    heights
        Empty: as in the system; otherwise :data:`UNSAID` or :data:`SEA_LEVEL`.
    position
        Longitude (degrees) or easting, latitude or northing, height; the height is NaN if unknown. None: no
        position.
    sd
        Standard deviations of east, north and height, metres; None without usable ones.
    rtk
        Whether they are internal accuracies of a receiver with real-time corrections.
    flag, fix
        DJI code of the solution, and its meaning: `fixed`, `float`, `single`, `none`, `unknown`; empty
        without a code.
    angles
        Three angles in degrees of the source (yaw, pitch, roll); they are not observations.
    remark
        Remark on all photos with this source; may be empty.
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
        """Meaning of the flag."""
        if self.flag is None:
            return "unknown" if self.rtk else ""
        return FIXED if 50 <= self.flag <= 59 else _FIXES.get(self.flag, "unknown")

    @property
    def is_located(self) -> bool:
        """Whether there is a position with a height."""
        return self.position is not None and not math.isnan(self.position[2])


def usable_deviations(east: float, north: float, height: float) -> Triple | None:
    """Return standard deviations; None if one is missing or not positive.

    A receiver without a solution writes 0. Values outside :data:`LEAST` and :data:`HIGHEST` are not usable
    either.
    """
    found = (east, north, height)
    return found if all(LEAST <= each <= HIGHEST for each in found) else None


def geographic_position(place: Place, values: Sequence[float]) -> Triple | None:
    """Return longitude, latitude (degrees), height; None for 0, 0."""
    longitude, latitude, height = values
    if not (abs(longitude) <= 180 and abs(latitude) <= 90):
        raise place.error(phrase("photos.degrees", longitude=longitude, latitude=latitude))
    if abs(height) > HIGHEST:
        raise place.error(phrase("photos.height", height=height, most=HIGHEST))
    return None if longitude == 0 and latitude == 0 else (longitude, latitude, height)


_NUMBER = re.compile(r"(?<!\d)\d{4}(?!\d)")
_TIME = re.compile(r"_?Timestamp", re.IGNORECASE)
_NAMED = ("N", "E", "V", "Lat", "Lon", "Ellh", "Q")
LARGEST_FLAG = 1000


def number_of(stem: str) -> int | None:
    """Return the exposure number of `DJI_0042`, `..._0042_V`; None without."""
    found = _NUMBER.findall(stem)
    return int(found[-1]) if found else None


def prefix_of(path: Path) -> str:
    """Return the name of a file before its time: the prefix of its photo names."""
    return _TIME.split(path.stem)[0]


def read_exposures(path: Path, *, antenna: bool) -> dict[int, Said]:
    """Read the exposures of an .MRK file by number.

    Section 6 of the specification: tab-separated number, seconds of the week, `[week]`, `dN,N`, `dE,E`,
    `dV,V` (antenna to camera, millimetres, north, east, down), `latitude,Lat`, `longitude,Lon`,
    `height,Ellh`, `sN, sE, sV` (standard deviations, metres), `flag,Q`. The position is the position of the
    camera. If `antenna`, it is the position of the antenna.
    """
    found: dict[int, Said] = {}
    for place in filled_lines(path):
        number, said = _exposure(place, antenna)
        if found.setdefault(number, said) is not said:
            raise place.error(phrase("format.repeated", what="exposure", name=str(number)))
    return found


def _exposure(place: Place, antenna: bool) -> tuple[int, Said]:
    cells = [each.strip() for each in (place.text or "").split("\t")]
    if len(cells) < 11:
        raise place.error(phrase("format.words", n=len(cells), required="11 words between tabs"))
    number, seconds, week, *rest = cells
    if not (week.startswith("[") and week.endswith("]")):
        raise place.error(phrase("photos.week", value=week))
    parts = [[each.strip() for each in cell.split(",")] for cell in rest]
    named = {part[1]: part[0] for part in parts if len(part) == 2}
    accuracies = [part for part in parts if len(part) == 3]
    missing = [each for each in _NAMED if each not in named] + ([] if accuracies else ["sN, sE, sV"])
    if missing:
        raise place.error(phrase("format.member", name=missing[0]))
    north, east, up = (place.number(each, "standard deviation") for each in accuracies[-1])
    flag = place.whole(named["Q"], "Q", highest=LARGEST_FLAG)
    to_north, to_east, down = (place.number(named[each], each) / 1000 for each in "NEV")
    place_of_camera = [place.number(named[each], each) for each in ("Lon", "Lat", "Ellh")]
    position = geographic_position(place, place_of_camera)
    place.number(seconds, "seconds")
    place.whole(week[1:-1].strip(), "week", highest=10**5)
    if antenna and position is not None:
        longitude, latitude, height = position
        known = np.array([[math.radians(longitude), math.radians(latitude), height]])
        per_radian = lengths_of_units(known, Spheroid.wgs84())[0]
        position = (
            longitude + math.degrees(to_east / float(per_radian[0])),
            latitude + math.degrees(to_north / float(per_radian[1])),
            height - down,
        )
    sd = usable_deviations(east, north, up) if flag else None
    said = Said(".MRK", place, ELLIPSOIDAL, "", position, sd, rtk=flag != 0, flag=flag)
    return place.whole(number, "number", highest=10**6), said


SOURCE = "RTKLIB"
SECONDS_OF_WEEK = 604_800
HEADER_LINES = 60
_COMMENT = "%"
_FLAGS = {1: 50, 2: 34, 5: 16}  # Quality of RTKLIB as the flag of DJI: fixed, float, single
_GEODETIC = ("latitude", "longitude", "height", "Q", "ns", "sdn", "sde", "sdu")
_GEOCENTRIC = ("x", "y", "z", "Q", "ns", "sdx", "sdy", "sdz", "sdxy", "sdyz", "sdzx")
_WORDS = re.compile(r"[,;\s]+")
_EPOCH = datetime(1980, 1, 6)


def is_events(path: Path) -> bool:
    """Return whether a text file has the header of RTKLIB solutions."""
    return any(_is_header(line) for line in islice(read_lines(path), HEADER_LINES))


def _is_header(line: str) -> bool:
    return line.startswith(_COMMENT) and ("latitude(" in line or "x-ecef(" in line or "e-baseline(" in line)


def read_events(path: Path) -> list[tuple[float, Said]]:
    """Read times of exposures (seconds since the first GPS week) and their positions, in order of time."""
    head, heights, events = Place(path), "", list[tuple[float, Said]]()
    for record, line in enumerate(read_lines(path), 1):
        if line.startswith(_COMMENT):
            heights = SEA_LEVEL if "/geodetic" in line else heights
            head = Place(path, record, line) if _is_header(line) else head
        elif line.strip():
            events.append(_event(Place(path, record, line), head, heights))
    if not events:
        raise head.error(phrase("format.missing", what="events of RTKLIB"))
    return sorted(events, key=lambda event: event[0])


def _event(place: Place, head: Place, heights: str) -> tuple[float, Said]:
    columns = head.text or ""
    if "e-baseline(" in columns:
        raise head.error(phrase("photos.baselines"))
    geocentric, minutes = "x-ecef(" in columns, "latitude(d'" in columns
    names = _GEOCENTRIC if geocentric else _GEODETIC
    words = _WORDS.split((place.text or "").strip())
    if len(words) < 2 + len(names) + 4 * minutes:
        raise place.error(phrase("format.words", n=len(words), required=f"date, time, {', '.join(names)}"))
    time, words = words[:2], words[2:]
    if minutes:
        words = [repr(_degrees(words[:3], place)), repr(_degrees(words[3:6], place)), *words[6:]]
    cells = dict(zip(names, words, strict=False))
    flag = _FLAGS.get(place.whole(cells.pop("Q"), "Q", highest=9))
    first, second, third, _, *deviations = (place.number(word, name) for name, word in cells.items())
    if geocentric:
        position, (east, north, up) = _geographic((first, second, third), deviations)
    else:
        position, (north, east, up) = (second, first, third), deviations
    heights, known = "" if geocentric else heights, geographic_position(place, position)
    sd = usable_deviations(east, north, up)
    return _seconds(time, place), Said(SOURCE, place, ELLIPSOIDAL, heights, known, sd, rtk=True, flag=flag)


def _geographic(xyz: Sequence[float], deviations: Sequence[float]) -> tuple[Triple, Triple]:
    """Convert X, Y, Z to geographic coordinates with standard deviations.

    `deviations` are standard deviations of X, Y, Z, and signed roots of the covariances XY, YZ, ZX. X, Y, Z
    of 0 are not converted.
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
    """Return seconds since the first GPS week from date or week."""
    if "/" not in words[0]:
        week = place.whole(words[0], "week", highest=10**5)
        return week * SECONDS_OF_WEEK + place.number(words[1], "seconds")
    try:
        time = datetime.strptime(f"{words[0]} {words[1].partition('.')[0]}", "%Y/%m/%d %H:%M:%S")
    except ValueError:
        raise place.error(phrase("photos.time", value=" ".join(words))) from None
    return (time - _EPOCH).total_seconds() + place.number(f"0.{words[1].partition('.')[2] or 0}", "time")


REFERENCE = "reference"
GEO_TXT = "geo.txt"  # Table of OpenDroneMap: positions in the system of its first line
WORDS = (3, 4, 7, 9)  # Numbers of words per line; words after the ninth are ignored
HEAD = 40  # Number of lines that are searched for a header, a row or a system
_KNOWN = (*TABLES["gnss"].columns, "enabled")
_NUMBERS = TABLES["gnss"].numbers
_REQUIRED = ("photo", *AXES)
_PIX4D = {3: (), 5: ("sd_xy", "sd_z"), 6: ("",) * 3, 8: (*("",) * 3, "sd_xy", "sd_z")}
"""Columns after the position in Pix4D tables without header, by count of numbers: angles, accuracies."""
_SYSTEM = re.compile(r"#\s*CoordinateSystem:\s*(.+)", re.IGNORECASE)
_SEPARATORS = re.compile(r"[,;\t|]")


def is_reference(path: Path, pictures: Callable[[str], object] | None = None) -> bool:
    """Return whether a text file has positions by photo name.

    A table with columns of photos and points has image observations. So has one without header that repeats a
    photo. If the names may be point names, one must name an image file: by its suffix, or by `pictures`,
    which returns the image files of a name.
    """
    head = [line for line in islice(read_lines(path), HEAD) if line.strip()]
    for k, line in enumerate(head):
        if (names := _header(line)) is not None:
            if any(is_photo(each) for each in names):
                return not any(column_of(each) == "point" for each in names)
            column = PLAIN.spelled(_KNOWN, names).index("photo")
            rows = map(_cells, head[k + 1 :])
            photos = [cells[column] for cells in rows if len(cells) > column]
            unnamed = names[column] == "label" and pictures is None
            own = (each.lower().endswith(ENDINGS) or (pictures and pictures(each)) for each in photos)
            return unnamed or any(own)
    first = next((line for line in head if not line.startswith("#") and len(_cells(line)) > 1), "")
    if not _is_row(first):
        return False
    known = set[str]()
    for line in read_lines(path):
        name = _cells(line)[0]
        if name in known and _is_row(line):
            return False
        known.add(name)
    return True


def _cells(line: str) -> list[str]:
    return [each.strip().strip('"') for each in _SEPARATORS.split(line)]


def _header(line: str) -> list[str] | None:
    """Return the headings of photo and position columns; None without."""
    own = [each.lower() for each in _cells(line.lstrip().removeprefix("#"))]
    return own if set(_REQUIRED) <= set(PLAIN.spelled(_KNOWN, own)) else None


def _is_row(line: str) -> bool:
    """Return whether a line is a Pix4D row: a photo, and its numbers."""
    name, *numbers = _cells(line)
    if not name.lower().endswith(ENDINGS) or len(numbers) not in _PIX4D:
        return False
    try:
        return all(math.isfinite(finite_number(each)) for each in numbers)
    except ValueError:
        return False


def read_reference(path: Path, messages: list[Message]) -> dict[str, Said]:
    """Read a table of positions by photo name.

    Section 6 of the specification: columns by their names, units by their headings. A single accuracy applies
    to each axis. Rows disabled in Metashape are skipped.
    """
    head = list(islice(read_lines(path), HEAD))
    crs = next((match[1].strip() for line in head if (match := _SYSTEM.match(line.strip()))), "")
    rows = [line for line in head if _is_row(line)]
    if rows and not any(_header(line) for line in head):
        first = [finite_number(each) for each in _cells(rows[0])[1:]]
        angular = abs(first[0]) <= 90 and abs(first[1]) <= 180
        axes = ("y", "x", "z") if angular else AXES
        table = read_rows(path, ("photo", *axes, *_PIX4D[len(first)]), numbers=(*_NUMBERS, "sd_xy"))
    else:
        table = read_columns(path, known=_KNOWN, numbers=_NUMBERS, spelling=partial(PLAIN.spelled, _KNOWN))
        angular = is_geographic(table)
    table = settled(table, PLAIN, _KNOWN, column_units("gnss"), _REQUIRED, (), REFERENCE, messages)
    used, xyz = table.flags("enabled"), table.vectors(AXES)
    common, sd = (table.vectors(names, infinite=True) for names in (("sd",), deviation_columns(AXES)))
    sd = np.where(np.isnan(sd), common, sd)
    system = (UNSAID_SYSTEM, UNSAID) if angular and not crs else (crs, "")
    found: dict[str, Said] = {}
    for row, name in enumerate(table.names_once("photo")):
        (x, y, z), place = xyz[row].tolist(), table.place(row)
        position = None if math.isnan(x) or math.isnan(y) else (x, y, z)
        if angular and position is not None:
            position = geographic_position(place, position)
        if used[row]:
            found[name] = Said(REFERENCE, place, *system, position, usable_deviations(*sd[row].tolist()))
    return found


def read_geo_txt(path: Path) -> dict[str, Said]:
    """Read positions by photo name from `geo.txt`.

    Section 6 of the specification: `name x y [z [yaw pitch roll [sd_h sd_v]]]`; sd_h applies to east and
    north each. Without the two columns, standard deviations of another source are used.
    """
    if not (places := list(filled_lines(path))):
        raise Place(path).error(phrase("format.crs"))
    head, *rest = places
    crs = system_of((head.text or "").strip(), head)
    found: dict[str, Said] = {}
    for place in rest:
        name, *words = (place.text or "").split()
        if name in found:
            raise place.error(phrase("format.repeated", what="photo", name=name))
        count = len(words) + 1
        if count not in WORDS and count < WORDS[-1]:
            required = "name x y [z [yaw pitch roll [sd_h sd_v]]]"
            raise place.error(phrase("format.words", n=count, required=required))
        values = [place.number(word) for word in words[:8]] + [math.nan] * (8 - len(words))
        x, y, z, yaw, pitch, roll, horizontal, vertical = values
        sd, position = usable_deviations(horizontal, horizontal, vertical), (x, y, z)
        known = geographic_position(place, position) if crs in (ELLIPSOIDAL, UNSAID_SYSTEM) else position
        angles = None if count < 7 else (yaw, pitch, roll)
        found[name] = Said(GEO_TXT, place, crs, position=known, sd=sd, angles=angles)
    return found
