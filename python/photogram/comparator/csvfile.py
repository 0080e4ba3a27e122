"""Plain tables: comma-separated values below lines `# key = value`."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from photogram.arguments.objects import require
from photogram.io.column_table import ColumnTable, TableRow
from photogram.io.delimited import read_records
from photogram.io.places import Place, at_place
from photogram.messages import unknown_name
from photogram.words import phrase

MICROMETRES = {"um": 1.0, "mm": 1000.0}  # by the suffix of a column name
NOTE = "note"  # the key of comments


@dataclass(frozen=True, slots=True)
class Setting:
    """Setting line above the table."""

    key: str
    text: str
    place: Place

    def integer(self) -> int:
        """Return a non-negative integer."""
        return self.place.whole(self.text, self.key)

    def number(self) -> float:
        """Return a finite number."""
        return self.place.number(self.text, self.key)

    def switch(self) -> bool:
        """Return a Boolean given as yes or no."""
        with at_place(self.place):
            require(
                self.text.lower() in ("yes", "no"), self.key, "choice", value=self.text, names=["yes", "no"]
            )
        return self.text.lower() == "yes"


@dataclass(frozen=True)
class Table:
    """Table with coordinates."""

    records: ColumnTable
    settings: Mapping[str, Setting]
    unit: str  # um or mm

    def text(self, key: str) -> str:
        """Return the text of a setting; empty if it is missing."""
        return self.settings[key].text if key in self.settings else ""

    def coordinates_um(self, row: TableRow) -> tuple[float, float] | None:
        """Return x and y of a row in micrometres; None if both are blank."""
        x, y = row.number(f"x_{self.unit}"), row.number(f"y_{self.unit}")
        if x is None and y is None:
            return None
        if x is None or y is None:
            raise row.error(phrase("comparators.coordinate"))
        factor = MICROMETRES[self.unit]
        return x * factor, y * factor


def read_table(path: Path, *columns: str, keys: Collection[str] | None = None) -> Table:
    """Read a table with coordinates and other columns.

    `keys` are the possible settings, None for any.
    """
    records = read_records(path, spelling=lambda names: [name.lower() for name in names])
    records.require(*columns)
    settings: dict[str, Setting] = {}
    for place in records.comments:
        key, equals, value = (place.text or "").lstrip("# ").partition("=")
        name = key.strip().lower()
        if equals and keys is not None and name != NOTE:
            if name not in keys:
                raise place.error(unknown_name("setting", "_".join(name.split()), keys))
            if name in settings:
                raise place.error(phrase("error.repeated", kind="setting", name=name))
        if equals:
            settings[name] = Setting(name, value.strip(), place)
    units = [{unit for unit in MICROMETRES if f"{axis}_{unit}" in records.columns} for axis in "xy"]
    if units[0] != units[1] or len(units[0]) != 1:
        raise records.head.error(phrase("comparators.units", names=list(records.columns)))
    return Table(records, settings, units[0].pop())
