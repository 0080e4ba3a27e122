"""Plain tables: comma-separated values with `# key = value` lines above the names of the columns."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from photogram.io import rows
from photogram.io.numbers import finite_number, whole_number
from photogram.io.places import Place
from photogram.io.rows import Row
from photogram.messages import nearest, quoted

MICROMETRES = {"um": 1.0, "mm": 1000.0}  # Units of coordinates, as the names of columns end
NOTE = "note"  # The key of lines that set nothing


@dataclass(frozen=True, slots=True)
class Setting:
    """What a line above the table sets, and where."""

    key: str
    text: str
    place: Place

    def integer(self) -> int:
        """Return the whole number that it sets."""
        try:
            return whole_number(self.text)
        except ValueError as error:
            raise self.place.error(f"{self.key} = {error}") from None

    def number(self) -> float:
        """Return the number that it sets.

        Raises
        ------
        InputError
            It is none.
        """
        try:
            return finite_number(self.text)
        except ValueError as error:
            raise self.place.error(f"{self.key} = {error}") from None

    def switch(self) -> bool:
        """Return the yes or no that it sets."""
        if self.text.lower() not in ("yes", "no"):
            raise self.place.error(f"{self.key} = {quoted(self.text)} is neither yes nor no")
        return self.text.lower() == "yes"


@dataclass(frozen=True)
class Table:
    """A table with coordinates: its records, what the lines above set by name, and its unit (um or mm)."""

    records: rows.Table
    settings: Mapping[str, Setting]
    unit: str

    @property
    def path(self) -> Path:
        """The file."""
        return self.records.path

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.records.columns

    def text(self, key: str) -> str:
        """Return what a setting says; nothing where it is not there."""
        return self.settings[key].text if key in self.settings else ""

    def coordinates_um(self, row: Row) -> tuple[float, float] | None:
        """Return x and y of a row in micrometres; None where both are blank."""
        x, y = row.number(f"x_{self.unit}"), row.number(f"y_{self.unit}")
        if x is None and y is None:
            return None
        if x is None or y is None:
            raise row.place.error("one coordinate is there, the other is blank")
        factor = MICROMETRES[self.unit]
        return x * factor, y * factor


def read_table(path: Path, *columns: str, keys: Collection[str] | None = None) -> Table:
    """Read a table with coordinates in micrometres or millimetres.

    Parameters
    ----------
    path
        The file.
    columns
        Columns that it must have besides coordinates.
    keys
        What `# key = value` lines may set besides `note`; None where nothing depends on them.
    """
    records = rows.Table.read(path, comment="#", spelling=str.lower)
    records.require(*columns)
    settings: dict[str, Setting] = {}
    for place in records.comments:
        key, equals, value = (place.text or "").lstrip("# ").partition("=")
        if equals:
            name = key.strip().lower()
            if keys is not None:
                _refuse_key(name, (*keys, NOTE), settings, place)
            settings[name] = Setting(name, value.strip(), place)
    return Table(records, settings, _unit(records))


def _refuse_key(name: str, known: Collection[str], settings: Mapping[str, Setting], place: Place) -> None:
    """Refuse a setting that nothing reads: it would be lost without a word."""
    if name not in known:
        meant = nearest("_".join(name.split()), known)
        raise place.error(f"there is no setting {quoted(name)}{meant}")
    if name in settings and name != NOTE:
        raise place.error(f"{name} is set twice")


def _unit(records: rows.Table) -> str:
    """Return the one unit that both coordinates are in."""
    there = set(records.columns)
    units = {axis: [unit for unit in MICROMETRES if f"{axis}_{unit}" in there] for axis in "xy"}
    found = {unit for of_axis in units.values() for unit in of_axis}
    if len(found) > 1:
        raise records.head.error("units are mixed: x and y must both be in um, or both in mm")
    if not all(units.values()):
        raise records.head.error("there must be columns x_um and y_um, or x_mm and y_mm")
    return found.pop()
