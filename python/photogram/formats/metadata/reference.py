"""Tables of references: Metashape's, with a header in any order, and Pix4D's geolocation without one."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.column_words import words_of
from photogram.formats.columns import PLAIN, is_geographic, settled
from photogram.formats.metadata.pictures import ENDINGS
from photogram.formats.metadata.record import (
    UNSAID,
    UNSAID_SYSTEM,
    Said,
    geographic_position,
    usable_deviations,
)
from photogram.formats.plain.schema import AXES, TABLES, deviation_columns
from photogram.io.delimited import ColumnTable, read_columns, read_rows
from photogram.io.files import read_lines
from photogram.io.numbers import finite_number
from photogram.messages import Message

__all__ = ["is_reference", "read_reference"]

SOURCE = "reference"
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

    Parameters
    ----------
    path
        The file.
    messages
        Where remarks go.

    Raises
    ------
    InputError
        A table at fault, a name that is there twice, angles beyond the earth.

    Notes
    -----
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
