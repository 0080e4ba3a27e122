"""Quantities: arrays with a name and a unit, declared once for all output formats.

A table is a list of quantities of the same n items. `frame` creates CSV files and data frames, `records` JSON
documents, `results.result_files` Parquet, `show.forms` text, `show.html` pages for the browser.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from photogram.arguments.arrays import by_key
from photogram.arguments.types import Bools, Floats, Indices
from photogram.io.csv_text import csv_text
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    import pandas as pd

Kind = Literal["value", "deviation", "difference", "number", "probability", "name"]


@dataclass(frozen=True)
class Axis:
    """A component of positions, attitudes, parameters or image coordinates."""

    name: str
    unit: str = ""  # Empty without a unit
    angle: Literal["", "dms", "deg"] = ""  # Notation in reports: degrees, minutes, seconds; degrees; radians
    suffix: str = ""  # Suffix of column names for the unit
    # Unit of differences and deviations in reports, and its factor
    small: str = ""
    factor: float = 1.0
    label: str = ""  # Name on pages if it differs from `name`

    @classmethod
    def of(cls, name: str, unit: str, suffix: str = "") -> Axis:
        """Return an axis whose deviations have the same unit."""
        return cls(name, unit, suffix=suffix, small=unit)

    @classmethod
    def turned(cls, name: str, angle: Literal["", "dms", "deg"] = "") -> Axis:
        """Return an axis in radians, whose deviations are seconds of arc."""
        return cls(name, "rad", angle, "_deg" if angle else "_rad", "arcsec", 1.0 / ARCSEC)


@dataclass(frozen=True)
class Link:
    """Photos or points (`kind`) of names: all `rows`; `here` for own page rows."""

    kind: str
    rows: Indices
    here: bool = False

    @property
    def targets(self) -> list[str]:
        return [f"{self.kind}-{row}" for row in self.rows.tolist()]


@dataclass(frozen=True, eq=False)
class Quantity:
    """A quantity of n items: one number or name of each, or k components."""

    values: Any  # (n,), or (n, k) with k axes; (n,) also with a common axis
    axes: tuple[Axis, ...] = ()  # The components, also if each row has one of them (`of`)
    # `value`: in the unit of its axis, angles in degrees; `deviation`, `difference`: in the small unit;
    # `number`: without a unit; `name`: text, or the number of an item
    kind: Kind = "number"
    # Prefix of columns in files and data frames; None: omitted there
    name: str | None = None
    # Name in JSON, or names of parts of its components; empty: omitted there
    member: str | Mapping[str, slice] = ""
    about: str = ""  # Description in Parquet; `{}` is the name of an axis
    # Columns of pages; `{}` is the name of an axis. `figures` significant figures if the decimals are not
    # defined. A quantity without a head is omitted.
    head: str = ""
    decimals: int | None = None
    figures: int = 3
    words: Mapping[float, str] | None = None  # Texts for single numbers, such as `fixed` for 0
    seen: Bools | None = None  # Mask of visible values; None: all
    # Mask of marked values; None: none
    marked: Bools | None = None
    link: Link | None = None  # Target of a name on a page
    of: Indices | None = None  # (n,) the axis of each row

    @property
    def single(self) -> bool:
        return not self.axes or self.of is not None or np.ndim(self.values) == 1

    def unit(self, axis: Axis) -> str:
        if self.kind == "number":
            return ""
        if self.kind == "value":
            return {"dms": "", "deg": "deg"}.get(axis.angle, axis.unit)
        return axis.small

    def outward(self) -> Any:
        """Return numbers in report units; angles in degrees only for `deg`."""
        values = np.asarray(self.values, dtype=float if self.axes or self.kind == "probability" else None)
        if self.seen is not None:
            values = np.where(self.seen, values, np.nan)
        if self.kind in ("value", "deviation", "difference") and self.axes:
            own = {"deg": math.degrees(1.0)}
            factors = [
                own.get(axis.angle, 1.0) if self.kind == "value" else axis.factor for axis in self.axes
            ]
            values = values * np.array(factors)[... if self.of is None else self.of]
        return values

    def at(self, rows: Indices, axes: Indices | None = None) -> Quantity:
        """Return the quantity of some items; with `axes`, one component of each."""
        one = axes is not None and not self.single
        parts: dict[str, Any] = {
            name: np.asarray(part)[(rows, axes) if one else rows]
            for name in ("values", "seen", "marked", "of")
            if (part := getattr(self, name)) is not None
        }
        link = self.link and replace(self.link, rows=self.link.rows[rows])
        return replace(self, **{**parts, "link": link, "of": axes if one else parts.get("of")})


Quantities = Sequence[Quantity]  # Quantities of the same items


@dataclass(frozen=True, eq=False)
class Table:
    """A table of a result, declared once for all forms of a document."""

    # Name in JSON documents: `a.b` for a part of member `a`; empty if another member contains its rows
    key: str
    title: str
    columns: Quantities
    note: str = ""  # a remark on this table
    about: str = ""  # the meaning of the columns
    deviations: Floats | None = None  # (n,) or (n, k) standard deviations, which define decimals
    shown: Indices | None = None  # (r,) visible rows, or (r, 2) visible rows and components; None: all
    keyed: bool = False  # Whether JSON documents have an object with one member per name of the first column

    @property
    def visible(self) -> bool:
        """Whether reports show it; other tables are in JSON and files only."""
        rows = self.columns[0].values if self.shown is None else self.shown
        return len(rows) > 0 and any(column.head for column in self.columns)

    def frame(self) -> pd.DataFrame:
        import pandas as pd

        return pd.DataFrame(frame(self.columns))

    def record(self) -> list[dict[str, Any]] | dict[str, dict[str, Any]]:
        """Return rows for JSON: a list, or an object with first column names."""
        if self.keyed:
            names = np.asarray(self.columns[0].values).tolist()
            return dict(zip(names, records(self.columns[1:]), strict=True))
        return records(self.columns)

    def csv(self) -> bytes:
        """Return the named columns as CSV, after their units."""
        return csv_text(frame(self.columns), unit_comments(self.columns))


def of_each(
    things: Sequence[Any], attribute: str, axes: tuple[Axis, ...] = (), kind: Kind = "number", **more: Any
) -> Quantity:
    """Return an attribute (`a.b`) of n items; `member` is its name in JSON documents."""
    found = [*map(attrgetter(attribute), things)]
    values = np.array(found, dtype=object if kind == "name" else None)
    return Quantity(values, axes, kind, **{"member": more.get("name") or attribute, **more})


def column(name: str, values: Any, head: str = "", **more: Any) -> Quantity:
    """Return a quantity with the same name in files and in JSON documents."""
    return Quantity(values, **{"name": name, "member": name, "head": head, **more})


def named(table: Quantities, name: str) -> Quantity:
    return next(column for column in table if column.name == name)


def for_people(table: Quantities) -> list[Quantity]:
    """Return a table that JSON documents omit."""
    return [replace(each, member="") for each in table]


def chosen(table: Quantities, rows: Indices) -> list[Quantity]:
    """Return the table of some of its items."""
    return [each.at(rows) for each in table]


def long(table: Quantities, places: Indices) -> list[Quantity]:
    """Return a table with one row per component; (r, 2) items and axes."""
    rows, axis = places.T
    several = [each for each in table if not each.single]
    found = chosen([each for each in table if each.single], rows) + component(several[0].axes, axis)
    return found + [each.at(rows, axis) for each in several]


def component(axes: tuple[Axis, ...], of: Indices) -> list[Quantity]:
    """Return the component of each row of a table, and its unit."""
    names, units = (
        np.array([getattr(axis, what) for axis in axes], dtype=object)[of] for what in ("name", "unit")
    )
    which, about = "which of its components", "of this row; empty if dimensionless"
    return [
        Quantity(names, axes, "name", "component", about=which, head="Component", of=of),
        Quantity(units, kind="name", name="unit", about=f"unit of values, residuals and deviations {about}"),
    ]


def joined(tables: Sequence[Quantities]) -> list[Quantity]:
    """Return concatenated tables of the same quantities."""
    found = []
    for parts in zip(*tables, strict=True):
        values = np.concatenate([np.asarray(each.values) for each in parts])
        axes = tuple(axis for each in parts for axis in each.axes)
        of = None
        if parts[0].of is not None:
            before = np.cumsum([0, *(len(each.axes) for each in parts)])[:-1]
            of = np.concatenate([each.of + first for each, first in zip(parts, before, strict=True)])
        found.append(replace(parts[0], values=values, axes=axes, of=of))
    return found


def frame(table: Quantities) -> dict[str, Any]:
    """Return columns of files: angles in degrees, other units in names."""
    return {name: values for name, _, values in _columns(table)}


def unit_comments(table: Quantities) -> list[str]:
    """Return one line per unit of the columns of `frame`, if not in the name."""
    names = by_key((unit, name) for name, unit, _ in _columns(table))
    return [f"unit of {', '.join(own)}: {unit}" for unit, own in names.items() if unit]


def _columns(table: Quantities) -> Iterator[tuple[str, str, Any]]:
    """Yield the names of columns, their units if not in the name, and their values."""
    for each in table:
        if each.name is None:
            continue
        if each.single:
            yield each.name, "", each.values
            continue
        for axis, column in zip(each.axes, each.values.T, strict=True):
            plain = each.kind == "number"
            suffix = "" if plain else axis.suffix
            name = f"{each.name}_{axis.name}{suffix}".removeprefix("_")
            with np.errstate(over="ignore"):  # infinite in this case
                values = np.degrees(column) if axis.angle and suffix else column
            yield name, "" if plain or suffix else axis.unit, values


def members(thing: object, *names: str, **others: str) -> dict[str, Any]:
    """Return attributes as JSON members, others (`a.b`) with other names."""
    attributes = {**dict(zip(names, names, strict=True)), **others}
    values = {name: attrgetter(attribute)(thing) for name, attribute in attributes.items()}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


def members_of_each(things: Sequence[object], *names: str, **others: str) -> list[Quantity]:
    """Return attributes of n items, as in `members`, for JSON documents only."""
    rows = [members(thing, *names, **others) for thing in things]
    return [Quantity([row[name] for row in rows], member=name) for name in (*names, *others)]


def records(table: Quantities) -> list[dict[str, Any]]:
    """Return JSON rows: longitudes and latitudes in degrees, else radians."""
    columns: dict[str, Any] = {}
    for each in table:
        values = each.values
        turned = [k for k, axis in enumerate(each.axes) if axis.angle == "dms" and each.kind != "number"]
        if turned and each.of is None:
            values = values.copy()
            values[:, turned] = np.degrees(values[:, turned])
        parts = each.member if isinstance(each.member, Mapping) else {each.member: slice(None)}
        for name, part in parts.items():
            if name:
                own = values if isinstance(each.member, str) else values[:, part]
                columns[name] = own.tolist() if isinstance(own, np.ndarray) else own
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
