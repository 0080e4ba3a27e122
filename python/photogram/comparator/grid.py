"""Grid plates: built in, from a file, or square; plain tables below lines `# key = value`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache, cached_property
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from photogram.arguments.fields import check_fields
from photogram.arguments.objects import path_of, require
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.io.column_table import ColumnTable
from photogram.io.csv_text import csv_text
from photogram.io.delimited import read_records
from photogram.io.numbers import is_whole_number
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import unknown_name
from photogram.summaries import Brief
from photogram.words import phrase

MICROMETRES = {"um": 1.0, "mm": 1000.0}  # by the suffix of a column name
NOTE = "note"  # the key of comments
Keys = Mapping[str, Callable[[Place, str, str], Any]]
"""Readers of settings by key: functions of place, text and key."""


def text_of(place: Place, text: str, key: str) -> str:
    del place, key
    return text


def switch(place: Place, text: str, key: str) -> bool:
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
        if half_blank := np.flatnonzero(np.isnan(xy).sum(axis=1) == 1).tolist():
            raise self.records.error(half_blank[0], phrase("comparators.coordinate"))
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


BUILT_IN = (773, 1320, 778)  # The master grids of the program, in the order of its option MASTER (0, 1, 2)
# Settings above the coordinates of a plate
KEYS: Keys = {
    "grid": Place.whole,
    **dict.fromkeys(("owner", "adopted"), text_of),
    **dict.fromkeys(("sigma_um", "temperature_c", "expansion_per_k"), Place.number),
}
MOST_EXPANSION = 1e-3  # per kelvin; steel has 1.2e-5, glass 8e-6


@dataclass(frozen=True, eq=False, repr=False)
class Grid(Brief):
    """Grid plate with calibrated points.

    Attributes
    ----------
    number
        Number of the plate.
    points
        (l,) point numbers.
    xy_um
        (l, 2) calibrated coordinates in the axes of the plate, micrometres.
    sigma_um
        Standard deviation of a calibrated coordinate; None if unknown.
    adopted
        Date and basis of the calibration, as text.
    temperature_c, expansion_per_k
        Reference temperature of the coordinates (degrees Celsius), and relative expansion per kelvin; None if
        unknown.
    source
        Source file.
    """

    number: int
    points: Indices
    xy_um: Floats
    sigma_um: float | None = None
    adopted: str = ""
    source: Path | None = None
    temperature_c: float | None = None
    expansion_per_k: float | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        values, counts = np.unique(self.points, return_counts=True)
        if (counts > 1).any():
            self._refuse("points", "error.repeated", kind="point", name=str(values[counts > 1][0]))
        if self.xy_um.shape != (*np.shape(self.points)[:1], 2) or not np.isfinite(self.xy_um).all():
            shape = str(self.xy_um.shape)
            self._refuse("xy_um", "comparators.grid-shape", count=len(values), shape=shape)
        if self.sigma_um is not None and not 0 <= self.sigma_um < np.inf:
            self._refuse("sigma_um", "error.not-negative", value=self.sigma_um)
        if self.expansion_per_k is not None and not abs(self.expansion_per_k) < MOST_EXPANSION:
            limits = {"low": -MOST_EXPANSION, "high": MOST_EXPANSION}
            self._refuse("expansion_per_k", "error.range", value=self.expansion_per_k, **limits)

    def _refuse(self, field: str, code: str, **fields: object) -> NoReturn:
        message = phrase("error.at", what=field, message=phrase(code, **fields))
        plate = phrase("comparators.plate", plate=self.number)
        raise InputError(phrase("error.at", what=plate, message=message), file=self.source)

    @classmethod
    def square(
        cls, columns: int = 5, spacing_um: float = 50_000.0, number: int = 1, sigma_um: float | None = None
    ) -> Grid:
        """Return a centred square plate with points numbered along +X, then +Y."""
        steps = (np.arange(columns) - (columns - 1) / 2) * spacing_um
        y, x = np.meshgrid(steps, steps, indexing="ij")
        return cls(
            number, np.arange(1, columns**2 + 1), np.column_stack([x.ravel(), y.ravel()]), sigma_um=sigma_um
        )

    def at(self, temperature_c: float) -> Grid:
        """Return the plate at another temperature: X (1 + expansion (t - t0)).

        Raises
        ------
        InputError
            If its temperature or its expansion is unknown.
        """
        if self.temperature_c is None or self.expansion_per_k is None:
            self._refuse("temperature_c, expansion_per_k", "error.empty")
        growth = 1.0 + self.expansion_per_k * (temperature_c - self.temperature_c)
        return replace(self, xy_um=self.xy_um * growth, temperature_c=temperature_c)

    def rows_of(self, points: Indices) -> Indices:
        """Return the rows of points of the plate."""
        order = np.argsort(self.points)
        rows: Indices = order[np.searchsorted(self.points, points, sorter=order)]
        return rows

    def to_csv(self) -> bytes:
        """Return the plate as a file for :func:`read_grid`."""
        settings = {name: getattr(self, name) for name in KEYS if hasattr(self, name)}
        x, y = self.xy_um.T
        columns = {"point": self.points, "x_um": x, "y_um": y}
        return csv_text(columns, settings_lines({"grid": self.number, **settings}))


def read_grid(path: Path) -> Grid:
    """Read a plate with columns point, x_um, y_um (or x_mm, y_mm).

    Settings above the table are:

    * `# grid = number`, `# sigma_um = ...`
    * `# adopted = date`, `# owner = ...`, `# note = ...`
    * `# temperature_c = 20`, `# expansion_per_k = 8.5e-6`

    Points with blank coordinates are omitted.

    Raises
    ------
    InputError
        If the file cannot be read, is not such a table, or has an unknown setting.
    """
    path = path_of("path", path)
    table = read_table(path, "point", keys=KEYS)
    rows, xy_um = table.measured()
    rows.names_once("point")
    settings = {name: value for name, value in table.settings.items() if name not in ("grid", "owner")}
    return Grid(table.settings.get("grid", 0), rows.wholes("point"), xy_um, source=path, **settings)


def with_corrections(grid: Grid, points: Indices, corrections_um: Floats, sigma_um: float, when: str) -> Grid:
    """Return a plate with corrected points, their standard deviation and origin."""
    xy_um = grid.xy_um.copy()
    xy_um[grid.rows_of(points)] += corrections_um
    return replace(
        grid,
        xy_um=np.round(xy_um, 4),
        sigma_um=None if math.isnan(sigma_um) else sigma_um,
        adopted=f"{when}, from the values of {grid.adopted or 'an unknown date'}",
    )


@cache
def built_in_grid(number: int) -> Grid:
    """Return a master grid of the program: 773, 1320 or 778.

    Point 11 of 773 and point 13 of 778 are missing because a digit or sign is illegible in the report.

    Raises
    ------
    InputError
        If the number is not one of these.
    """
    if number not in BUILT_IN:
        raise InputError(unknown_name("built-in grid", str(number), map(str, BUILT_IN)))
    with as_file(files("photogram.comparator") / "grids" / f"{number}.csv") as path:
        return read_grid(path)


def find_grid(name: str) -> Grid:
    """Return a built-in plate by its number, or the plate of a file.

    Raises
    ------
    InputError
        If the name is neither a built-in number nor a plate file.
    """
    file = path_of("name", name)
    if is_whole_number(name) and not file.exists():
        return built_in_grid(Place().whole(name, "grid"))
    return read_grid(file)
