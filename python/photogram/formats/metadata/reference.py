"""Positions by the names of photos: `geo.txt`, references of Metashape, geolocation of Pix4D."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.cards import filled_lines
from photogram.formats.column_words import words_of
from photogram.formats.columns import PLAIN, is_geographic, settled
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
from photogram.formats.plain.schema import AXES, TABLES, deviation_columns
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import read_columns, read_rows
from photogram.io.files import read_lines
from photogram.io.numbers import finite_number
from photogram.io.places import Place
from photogram.messages import Message

SOURCE = "reference"
GEO_TXT = "geo.txt"
"""Of OpenDroneMap: positions in the system of the first line."""
WORDS = (3, 4, 7, 9)
"""How many a line of it may have; what follows the ninth is of no use here."""
HEAD = 40
"""Lines in which a header, a row or the name of a system is looked for."""
_KNOWN = (*TABLES["gnss"].columns, "enabled")
_NUMBERS = TABLES["gnss"].numbers
_REQUIRED = ("photo", *AXES)
_PIX4D = ("photo", "y", "x", "z", "sd_xy", "sd_z")
"""Columns of Pix4D's tables, which have no header: latitude comes first."""
_PHOTO = frozenset({"image", "imagename", "image name", "filename", "file name", "file"})
"""Headings of the column of photos that in other tables mean something else, or nothing."""
_SYSTEM = re.compile(r"#\s*CoordinateSystem:\s*(.+)", re.IGNORECASE)
_CELLS = re.compile(r"[,;\t|]")


def is_reference(path: Path) -> bool:
    """Whether a text file is a table of references: photos with positions, with a header or without."""
    return any(_is_row(line) or _is_header(line) for line in islice(read_lines(path), HEAD))


def _is_header(line: str) -> bool:
    cells = _CELLS.split(line.lstrip().removeprefix("#"))
    return set(_REQUIRED) <= set(_spelled([each.strip().strip('"').lower() for each in cells]))


def _spelled(own: Sequence[str]) -> list[str]:
    """Return our names of columns: a photo may be called an image or a file here."""
    return PLAIN.spelled(_KNOWN, ["photo" if " ".join(words_of(each)) in _PHOTO else each for each in own])


def _is_row(line: str) -> bool:
    """Whether a line is one of Pix4D's: a photo, and three or five numbers."""
    name, *numbers = (each.strip() for each in _CELLS.split(line))
    if not name.lower().endswith(ENDINGS) or len(numbers) not in (3, 5):
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
    plain = bool(rows) and not any(_is_header(line) for line in head)
    if plain:
        table = read_rows(path, _PIX4D[: len(_CELLS.split(rows[0]))], numbers=(*_NUMBERS, "sd_xy"))
    else:
        table = read_columns(path, known=_KNOWN, numbers=_NUMBERS, spelling=_spelled)
    return settled(table, PLAIN, _KNOWN, 1.0, _REQUIRED, (), SOURCE, messages), plain or is_geographic(table)


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
        raise Place(path).error("names no system of coordinates in its first line")
    head, *rest = places
    crs = system_of((head.text or "").strip(), head)
    found: dict[str, Said] = {}
    for place in rest:
        name, *words = (place.text or "").split()
        if name in found:
            raise place.error(f"the photo {name} is there already, in record {found[name].place.record}")
        found[name] = _said_of_line(words, crs, place)
    return found


def _said_of_line(words: list[str], crs: str, place: Place) -> Said:
    count = len(words) + 1
    if count not in WORDS and count < WORDS[-1]:
        raise place.error(f"has {count} words: name x y [z [yaw pitch roll [sd_h sd_v]]]")
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
