"""Positions by photo name: `geo.txt`, Metashape references, Pix4D tables."""

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
            return unnamed or any(_is_picture(each) or (pictures and pictures(each)) for each in photos)
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


def _is_picture(name: str) -> bool:
    return name.lower().endswith(ENDINGS)


def _is_row(line: str) -> bool:
    """Return whether a line is a Pix4D row: a photo, and its numbers."""
    name, *numbers = _cells(line)
    if not _is_picture(name) or len(numbers) not in _PIX4D:
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
    """Return the table in internal units, and whether it is geographic."""
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
    """Return (rows, 3) standard deviations by axis; NaN without."""
    own = table.vectors(deviation_columns(AXES), infinite=True)
    common = table.numbers("sd", infinite=True)[:, np.newaxis]
    found: Floats = np.where(np.isnan(own), common, own)
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
        geographic = crs in (ELLIPSOIDAL, UNSAID_SYSTEM)
        found[name] = Said(
            GEO_TXT,
            place,
            crs,
            position=geographic_position(place, (x, y, z)) if geographic else (x, y, z),
            sd=usable_deviations(horizontal, horizontal, vertical),
            angles=None if count < 7 else (yaw, pitch, roll),
        )
    return found
