"""Rows of comma-separated tables, whose errors name file, record and text."""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from photogram.files import read_lines
from photogram.messages import listed
from photogram.places import Place

__all__ = ["Row", "cells", "read_rows"]


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
        """Return a finite number; None where the cell is blank or the column is missing.

        Raises
        ------
        InputError
            The cell is no such number.
        """
        text = self.cells.get(column, "")
        if not text:
            return None
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.place.error(f"{column} {text!r} is not a number")
        return value

    def required(self, column: str) -> float:
        """Return a finite number.

        Raises
        ------
        InputError
            The cell is blank, or no such number.
        """
        value = self.number(column)
        if value is None:
            raise self.place.error(f"{column} is blank")
        return value


def cells(text: str) -> list[str]:
    """Split a record at its commas; quotation marks hold a cell together."""
    return [cell.strip() for cell in next(csv.reader([text]))]


def read_rows(path: Path, needed: Collection[str]) -> list[Row]:
    """Read a table whose first record names the columns; blank records do not count.

    Parameters
    ----------
    path
        The file.
    needed
        Columns that must be there. Cells that are missing at the end of a record are blank.

    Raises
    ------
    InputError
        The file cannot be read or a column is missing; or a record has more cells than there are columns.
    """
    places = [Place(path, number, line) for number, line in enumerate(read_lines(path), 1) if line.strip()]
    names = cells(places[0].text or "") if places else []
    missing = [name for name in needed if name not in names]
    if missing:
        what = "the column {} is missing" if len(missing) == 1 else "the columns {} are missing"
        place = places[0] if places else Place(path)
        raise place.error(what.format(listed(missing)))
    rows = []
    for place in places[1:]:
        found = cells(place.text or "")
        if len(found) > len(names):
            raise place.error(f"there are {len(found)} cells under {len(names)} columns")
        rows.append(Row(dict(zip(names, found, strict=False)), place))
    return rows
