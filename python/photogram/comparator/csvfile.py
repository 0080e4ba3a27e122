"""Plain tables: comma-separated values with `# key = value` lines above the names of the columns."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from photogram.errors import InputError
from photogram.files import read_bytes
from photogram.places import Place

__all__ = ["Row", "Table", "read_table"]

MICROMETRES = {"um": 1.0, "mm": 1000.0}
"""Units of coordinates, as the names of columns end."""


@dataclass(frozen=True)
class Row:
    """One record: its cells by column, and where it stands."""

    cells: Mapping[str, str]
    place: Place

    def integer(self, column: str, default: int | None = None) -> int:
        """Return a whole number that is not negative; `default` where the cell or the column is missing.

        Raises
        ------
        InputError
            The cell is blank without a default, or no such number.
        """
        text = self.cells.get(column, "")
        if not text and default is not None:
            return default
        if not (text.isascii() and text.isdigit()):
            raise self.place.error(f"{column} {text!r} is not a whole number")
        return int(text)

    def number(self, column: str) -> float | None:
        """Return a finite number; None where the cell is blank.

        Raises
        ------
        InputError
            The cell is no such number.
        """
        text = self.cells[column]
        if not text:
            return None
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.place.error(f"{column} {text!r} is not a number")
        return value


@dataclass(frozen=True)
class Table:
    """A file: what its head sets, its columns, its rows."""

    path: Path
    settings: Mapping[str, str]
    columns: tuple[str, ...]
    head: Place
    rows: tuple[Row, ...]
    unit: str

    def require(self, *columns: str) -> None:
        """Refuse a table without these columns.

        Raises
        ------
        InputError
            The first one missing.
        """
        missing = [column for column in columns if column not in self.columns]
        if missing:
            raise self.head.error(f"the column {missing[0]} is missing")

    def coordinates_um(self, row: Row) -> tuple[float, float] | None:
        """Return x and y of a row in micrometres; None where both are blank.

        Raises
        ------
        InputError
            One of them is blank, or no number.
        """
        x, y = row.number(f"x_{self.unit}"), row.number(f"y_{self.unit}")
        if x is None and y is None:
            return None
        if x is None or y is None:
            raise row.place.error("one coordinate is there, the other is blank")
        factor = MICROMETRES[self.unit]
        return x * factor, y * factor

    def integer_setting(self, key: str, default: int) -> int:
        """Return a whole number that the head sets.

        Raises
        ------
        InputError
            It is set to something else.
        """
        text = self.settings.get(key, str(default))
        if not (text.isascii() and text.isdigit()):
            raise InputError(f"{key} = {text!r} is not a whole number", file=self.path)
        return int(text)

    def switch(self, key: str) -> bool | None:
        """Return a yes or no that the head sets; None where it sets nothing.

        Raises
        ------
        InputError
            It is set to something else.
        """
        text = self.settings.get(key)
        if text is None:
            return None
        if text.lower() not in ("yes", "no"):
            raise InputError(f"{key} = {text!r} is neither yes nor no", file=self.path)
        return text.lower() == "yes"


def read_table(path: Path) -> Table:
    """Read a table with coordinates in micrometres or millimetres.

    Raises
    ------
    InputError
        The file cannot be read, has no names of columns, mixes units, or has a row of another length.
    """
    try:
        lines = read_bytes(path).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise InputError("is not a text file in UTF-8", file=path) from None
    settings: dict[str, str] = {}
    numbered = []
    for record, line in enumerate(lines, 1):
        if line.lstrip().startswith("#"):
            key, equals, value = line.lstrip("# ").partition("=")
            if equals:
                settings[key.strip().lower()] = value.strip()
        elif line.strip(" ,"):
            numbered.append(Place(path, record, line))
    if not numbered:
        raise InputError("holds no table", file=path)
    head, *body = numbered
    columns = tuple(name.lower() for name in _cells(head))
    return Table(
        path, settings, columns, head, tuple(_row(columns, place) for place in body), _unit(columns, head)
    )


def _cells(place: Place) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([place.text or ""]))]


def _row(columns: tuple[str, ...], place: Place) -> Row:
    cells = _cells(place)
    if len(cells) != len(columns):
        raise place.error(f"there are {len(cells)} cells under {len(columns)} columns")
    return Row(dict(zip(columns, cells, strict=True)), place)


def _unit(columns: tuple[str, ...], head: Place) -> str:
    """Return the one unit that both coordinates are in."""
    units = {axis: [unit for unit in MICROMETRES if f"{axis}_{unit}" in columns] for axis in "xy"}
    found = {unit for of_axis in units.values() for unit in of_axis}
    if len(found) > 1:
        raise head.error("units are mixed: x and y must both be in um, or both in mm")
    if not all(units.values()):
        raise head.error("there must be columns x_um and y_um, or x_mm and y_mm")
    return found.pop()
