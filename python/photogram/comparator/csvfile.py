"""Plain tables: comma-separated values below lines `# key = value`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.objects import require
from photogram.arguments.types import Floats
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import read_records
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import dataclass
from photogram.messages import unknown_name
from photogram.words import phrase

MICROMETRES = {"um": 1.0, "mm": 1000.0}  # by the suffix of a column name
NOTE = "note"  # the key of comments
Keys = Mapping[str, Callable[[Place, str, str], Any]]
"""Readers of settings by key: functions of place, text and key."""


def text_of(place: Place, text: str, key: str) -> str:
    del place, key
    return text


def switch(place: Place, text: str, key: str) -> bool:
    """Return a setting given as yes or no."""
    with at_place(place):
        require(text.lower() in ("yes", "no"), key, "choice", value=text, names=["yes", "no"])
    return text.lower() == "yes"


def settings_lines(values: Mapping[str, object]) -> list[str]:
    """Return settings as lines above a table, without unknown ones."""
    texts = {
        key: ("no", "yes")[value]
        if isinstance(value, bool)
        else f"{value:g}"
        if isinstance(value, float)
        else str(value)
        for key, value in values.items()
        if value is not None
    }
    return [f"{key} = {text}" for key, text in texts.items() if text]


@dataclass(frozen=True)
class Table:
    records: ColumnTable
    settings: Mapping[str, Any]
    places: Mapping[str, Place]  # Lines of the settings
    unit: str  # um or mm

    @cached_property
    def xy_um(self) -> Floats:
        """(rows, 2) coordinates in micrometres; NaN if both are blank."""
        xy = self.records.vectors((f"x_{self.unit}", f"y_{self.unit}")) * MICROMETRES[self.unit]
        for row in np.flatnonzero(np.isnan(xy).sum(axis=1) == 1)[:1].tolist():
            raise self.records.error(row, phrase("comparators.coordinate"))
        return xy

    def measured(self) -> tuple[ColumnTable, Floats]:
        """Return the rows with coordinates, and these."""
        rows = np.flatnonzero(~np.isnan(self.xy_um[:, 0]))
        return self.records.some(rows.tolist()), self.xy_um[rows]


def read_table(path: Path, *columns: str, keys: Keys | None = None) -> Table:
    """Read a table with coordinates and other columns; `keys` are the possible settings, None for any."""
    records = read_records(path, spelling=lambda names: [name.lower() for name in names])
    records.require(*columns)
    settings, places, readers = dict[str, Any](), dict[str, Place](), keys or {}
    for place in [] if keys is None else records.comments:
        key, equals, value = (place.text or "").lstrip("# ").partition("=")
        name = key.strip().lower()
        if not equals or name == NOTE:
            continue
        if name not in readers:
            raise place.error(unknown_name("setting", "_".join(name.split()), readers))
        if name in settings:
            raise place.error(phrase("error.repeated", kind="setting", name=name))
        settings[name], places[name] = readers[name](place, value.strip(), name), place
    units = [{unit for unit in MICROMETRES if f"{axis}_{unit}" in records.columns} for axis in "xy"]
    if units[0] != units[1] or len(units[0]) != 1:
        raise records.head.error(phrase("comparators.units", names=list(records.columns)))
    return Table(records, settings, places, units[0].pop())
