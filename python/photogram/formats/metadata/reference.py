"""Positions by the names of photos: `geo.txt`, references of Metashape, geolocation of Pix4D."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.cards import filled_lines
from photogram.formats.column_words import column_of
from photogram.formats.columns import PLAIN, is_geographic, is_photo, settled
from photogram.formats.control_lists import system_of
from photogram.formats.metadata.pictures import ENDINGS
from photogram.formats.metadata.record import (
    ELLIPSOIDAL,
    UNSAID,
    UNSAID_SYSTEM,
    Said,
    Triple,
    geographic_position,
    usable_deviations,
)
from photogram.formats.plain.schema import AXES, TABLES, column_units, deviation_columns
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import read_columns, read_rows
from photogram.io.files import read_lines
from photogram.io.numbers import finite_number
from photogram.io.places import Place
from photogram.messages import Message
from photogram.words import phrase

SOURCE = "reference"
GEO_TXT = "geo.txt"  # Of OpenDroneMap: positions in the system of the first line
WORDS = (3, 4, 7, 9)  # How many a line of it may have; what follows the ninth is of no use here
HEAD = 40  # Lines in which a header, a row or the name of a system is looked for
_KNOWN = (*TABLES["gnss"].columns, "enabled")
_NUMBERS = TABLES["gnss"].numbers
_REQUIRED = ("photo", *AXES)
_PIX4D = {3: (), 5: ("sd_xy", "sd_z"), 6: ("",) * 3, 8: (*("",) * 3, "sd_xy", "sd_z")}
"""Columns of Pix4D's tables after the position by the count of numbers: angles, accuracies; no header."""
_SYSTEM = re.compile(r"#\s*CoordinateSystem:\s*(.+)", re.IGNORECASE)
_SEPARATORS = re.compile(r"[,;\t|]")


def is_reference(path: Path, pictures: Callable[[str], object] | None = None) -> bool:
    """Whether a text file has positions by the names of photos, with a header or as Pix4D writes them.

    A table with a column of points beside the photos has image observations, as has one without a header
    that names a photo twice. If the names may be those of points, one must name a picture: by its ending, or
    by `pictures`, which returns the pictures of a name.
    """
    head = [line for line in islice(read_lines(path), HEAD) if line.strip()]
    for k, line in enumerate(head):
        if (names := _header(line)) is not None:
            return _names_photos(names, head[k + 1 :], pictures)
    first = next((line for line in head if not line.startswith("#") and len(_cells(line)) > 1), "")
    if not _is_row(first):
        return False
    photos = set[str]()
    for line in read_lines(path):
        name = _cells(line)[0]
        if name in photos and _is_row(line):
            return False
        photos.add(name)
    return True


def _cells(line: str) -> list[str]:
    return [each.strip().strip('"') for each in _SEPARATORS.split(line)]


def _header(line: str) -> list[str] | None:
    """Return the headings of a line that names photos and positions; None for another line."""
    own = [each.lower() for each in _cells(line.lstrip().removeprefix("#"))]
    return own if set(_REQUIRED) <= set(PLAIN.spelled(_KNOWN, own)) else None


def _names_photos(own: Sequence[str], lines: Sequence[str], pictures: Callable[[str], object] | None) -> bool:
    if any(is_photo(each) for each in own):
        return not any(column_of(each) == "point" for each in own)
    column = PLAIN.spelled(_KNOWN, own).index("photo")
    names = [cells[column] for line in lines if len(cells := _cells(line)) > column]
    if pictures is None:
        return own[column] == "label" or any(_is_picture(name) for name in names)
    return any(_is_picture(name) or pictures(name) for name in names)


def _is_picture(name: str) -> bool:
    return name.lower().endswith(ENDINGS)


def _is_row(line: str) -> bool:
    """Whether a line is one of Pix4D's: a photo, and its numbers."""
    name, *numbers = _cells(line)
    if not _is_picture(name) or len(numbers) not in _PIX4D:
        return False
    try:
        return all(math.isfinite(finite_number(each)) for each in numbers)
    except ValueError:
        return False


def read_reference(path: Path, messages: list[Message]) -> dict[str, Said]:
    """Read a table; return what it says by the names of photos.

    Section 6 of the specification: columns by their names, units by their headings; one accuracy is that of
    each axis. What is switched off in Metashape is left out.
    """
    head = list(islice(read_lines(path), HEAD))
    crs = next((match[1].strip() for line in head if (match := _SYSTEM.match(line.strip()))), "")
    table, angular = _table(path, head, messages)
    unsaid = angular and not crs
    used, xyz, sd = table.flags("enabled"), table.vectors(AXES), _deviations(table)
    found: dict[str, Said] = {}
    for row, name in enumerate(table.names_once("photo")):
        x, y, z = xyz[row].tolist()
        position = None if math.isnan(x) or math.isnan(y) else (x, y, z)
        if angular and position is not None:
            position = geographic_position(table.place(row), position)
        if used[row]:
            found[name] = Said(
                SOURCE,
                table.place(row),
                crs=UNSAID_SYSTEM if unsaid else crs,
                heights=UNSAID if unsaid else "",
                position=position,
                sd=usable_deviations(*sd[row].tolist()),
            )
    return found


def _table(path: Path, head: Sequence[str], messages: list[Message]) -> tuple[ColumnTable, bool]:
    """Return the table with its columns in our units, and whether they are longitudes and latitudes."""
    rows = [line for line in head if _is_row(line)]
    plain = bool(rows) and not any(_header(line) for line in head)
    angular = False
    if plain:
        numbers = [finite_number(each) for each in _cells(rows[0])[1:]]
        angular = abs(numbers[0]) <= 90 and abs(numbers[1]) <= 180
        axes = ("y", "x", "z") if angular else AXES
        table = read_rows(path, ("photo", *axes, *_PIX4D[len(numbers)]), numbers=(*_NUMBERS, "sd_xy"))
    else:
        table = read_columns(path, known=_KNOWN, numbers=_NUMBERS, spelling=partial(PLAIN.spelled, _KNOWN))
        angular = is_geographic(table)
    return settled(table, PLAIN, _KNOWN, column_units("gnss"), _REQUIRED, (), SOURCE, messages), angular


def _deviations(table: ColumnTable) -> Floats:
    """Return (rows, 3) standard deviations of the axes: each its own, else the one of all; NaN without."""
    own = table.vectors(deviation_columns(AXES), infinite=True)
    common = table.numbers("sd", infinite=True)[:, np.newaxis]
    found: Floats = np.where(np.isnan(own), common, own)
    return found


def read_geo_txt(path: Path) -> dict[str, Said]:
    """Read `geo.txt`; return what it says by the names of photos.

    Section 6 of the specification: `name x y [z [yaw pitch roll [sd_h sd_v]]]`; east and north have sd_h
    each. Without the two columns nothing is said of standard deviations: those of another source stay.
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
        found[name] = _said_of_line(words, crs, place)
    return found


def _said_of_line(words: list[str], crs: str, place: Place) -> Said:
    count = len(words) + 1
    if count not in WORDS and count < WORDS[-1]:
        raise place.error(
            phrase("format.words", n=count, required="name x y [z [yaw pitch roll [sd_h sd_v]]]")
        )
    values = [place.number(word) for word in words[:8]] + [math.nan] * (8 - len(words))
    x, y, z, yaw, pitch, roll, horizontal, vertical = values
    position: Triple | None = (x, y, z)
    if crs in (ELLIPSOIDAL, UNSAID_SYSTEM):
        position = geographic_position(place, (x, y, z))
    return Said(
        GEO_TXT,
        place,
        crs,
        position=position,
        sd=usable_deviations(horizontal, horizontal, vertical),
        angles=None if count < 7 else (yaw, pitch, roll),
    )
