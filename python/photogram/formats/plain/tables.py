"""Conversion of the tables of a plain project to numbers, and back."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError, message_of
from photogram.formats.column_words import is_angular
from photogram.formats.columns import PLAIN, check_unread, degrees, in_units, is_geographic, nameless, settled
from photogram.formats.images import Y_DOWN
from photogram.formats.plain.schema import (
    ALL_ANGLES,
    ANGLES,
    ANGULAR,
    AXES,
    REQUIRED,
    TABLES,
    TEXTS,
    column_units,
    covariance_columns,
)
from photogram.formats.plain.settings import Settings
from photogram.io.column_table import FALSE, TRUE, ColumnTable
from photogram.io.delimited import BATCH, read_batches, read_rows
from photogram.io.numbers import MATRIX_ROUNDING, degrees_typed, finite_number
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.network.attitudes import Attitudes, Representation, angles_form, known_angles
from photogram.network.block import Block
from photogram.network.geometry import Frame, rotation_fault
from photogram.network.observations import Observation, Observations
from photogram.network.unknowns import Unknown
from photogram.words import Phrase, phrase

_Made = TypeVar("_Made")
_Kind = TypeVar("_Kind", bound=Unknown)


def made(table: ColumnTable, row: int, make: Callable[..., _Made], *values: Any, **more: Any) -> _Made:
    """Create an object from a row; its errors name the row."""
    with at_place(table.at(row)):
        return make(*values, **more)


def made_of_rows(
    table: ColumnTable, make: type[Observation], arguments: Mapping[int, Mapping[str, Any]]
) -> Iterator[Observation | Observations[Any]]:
    """Yield observations of rows from their arguments; rows with the same types of arguments together."""

    def types(row: int) -> list[tuple[str, bool]]:
        return [(name, isinstance(value, Unknown)) for name, value in arguments[row].items()]

    for _, group in groupby(arguments, types):
        rows = list(group)
        columns = {name: [arguments[row][name] for row in rows] for name in arguments[rows[0]]}
        try:
            yield make.from_arrays(**columns)
        except InputError:
            # The first invalid row raises an error with its location.
            yield from (made(table, row, make, **arguments[row]) for row in rows)


def called(cell: str, title: str) -> str:
    """Return the name in a cell: title for `true`, empty for `false`, else the cell."""
    word = cell.lower()
    return title if word in TRUE else "" if word in FALSE else cell


def word_of(unknown: Unknown | None) -> str:
    """Return the cell of an unknown: its name, unless it is a word for true or false."""
    if unknown is None:
        return "false"
    return unknown.title if unknown.name.lower() in TRUE | FALSE else unknown.name


_Named = TypeVar("_Named")
_NUMBERS: Mapping[str, tuple[str, Callable[[Floats], Bools]]] = {
    "sd": ("error.not-negative", lambda values: values >= 0),
    "whole": ("error.whole", lambda values: values == np.round(values)),
    "positive": ("error.positive", lambda values: values > 0),
}
"""Code of the error, and the condition, of kinds of numbers."""
DEGREE = 180 / np.pi  # Degrees per radian


def _spelled(known: Collection[str], own: Sequence[str]) -> list[str]:
    """Return internal column names; geographic ones need a system."""
    names = PLAIN.spelled(known, own)
    return [heading if is_angular(heading) else name for heading, name in zip(own, names, strict=True)]


@dataclass(frozen=True)
class Tables:
    """The tables of a project with its settings, read on demand; collects remarks."""

    settings: Settings  # Settings of the project
    messages: list[Message]  # Remarks
    names: Collection[str] = ()  # Observed points, if they are known before the tables are read
    shared: dict[tuple[type[Unknown], str], Any] = field(default_factory=dict)
    """Unknowns in rows of all tables, by type and name."""
    parsed: dict[str, ColumnTable | None] = field(default_factory=dict)
    change: Callable[[str, ColumnTable], ColumnTable] = lambda _, table: table  # Of each batch of a table

    def read(self, name: str) -> ColumnTable | None:
        """Return a table if it exists, parsed once except images."""
        if name in self.parsed:
            return self.parsed[name]
        table = next(self.batches(name, None), None)
        if table is None and name == "photos" and "images" in self.settings.tables:
            table = self._photos_of_images()
        if name != "images":
            self.parsed[name] = table
        return table

    def batches(self, name: str, size: int | None = BATCH) -> Iterator[ColumnTable]:
        """Yield a table in batches of about `size` bytes; nothing if it does not exist."""
        if name not in self.settings.tables:
            return
        schema, path = TABLES[name], self.settings.tables[name]
        known, numbers, own = schema.columns, schema.numbers, self.settings
        units = column_units(name, own.length, own.angle, own.image)
        given = own.columns.get(name, PLAIN)
        spelling, hint = (given.spelled, nameless) if schema.has_system else (_spelled, None)
        if given.order:
            order = ["" if each == "-" else each for each in given.order]
            tables = iter([read_rows(path, order, numbers=numbers)])
        else:
            spelled = partial(spelling, known)
            tables = read_batches(path, known=known, numbers=numbers, spelling=spelled, hint=hint, size=size)
        for table in tables:
            required = schema.needed(table.columns)
            if schema.has_system:
                found = settled(table, given, known, units, required, self.names, name, self.messages)
            else:
                table.require(*required)
                found = in_units(table, units, name, self.messages)
                check_unread(found, PLAIN, known, name, self.messages)
            yield self.change(name, found)

    def _photos_of_images(self) -> ColumnTable | None:
        """Return a table of photos from the images, for a project without one."""
        images = self.read("images")
        assert images is not None
        photos = images.names("photo")
        _, rows = np.unique(photos.rows, return_index=True)
        cells = {"photo": photos.names}
        if "camera" in images:
            texts = images.texts("camera")
            cells["camera"] = [texts[row] for row in rows.tolist()]
            for row, photo in enumerate(photos.rows.tolist()):
                if texts[row] != cells["camera"][photo]:
                    fields = {"camera": texts[row], "other": cells["camera"][photo]}
                    raise images.error(row, phrase("plain.other-camera", **fields))
        records = [images.records[row] for row in rows.tolist()]
        return ColumnTable(images.path, images.head, tuple(cells), len(rows), cells, records)

    def rows(self, name: str) -> ColumnTable:
        """Return a table, possibly without rows; errors as :meth:`read`."""
        found = self.read(name)
        if found is not None:
            return found
        path, columns = self.settings.path, TABLES[name].columns
        return ColumnTable(path, Place(path), columns, 0, dict.fromkeys(columns, ()), ())

    def records(self, name: str, *, defaults: bool = False) -> list[dict[str, Any]]:
        """Return the filled cells of each row by column, with all checks of the declaration.

        Angles are in radians; standard deviations may be infinite. `defaults` adds the declared defaults.
        """
        table, schema = self.rows(name), TABLES[name]
        there = [each for each in dict.fromkeys(schema.columns) if each in table]
        columns = {each: self.column(name, each) for each in there}
        first = schema.defaults if defaults else {}
        return [
            first
            | {each: own[row] for each, own in columns.items() if own[row] != "" and own[row] == own[row]}
            for row in range(table.count)
        ]

    def column(self, table_name: str, name: str) -> Sequence[Any]:
        """Return the cells of a column, with all checks of its declaration; empty text and NaN: missing."""
        table = self.rows(table_name)
        column = next(each for each in TABLES[table_name].all_columns if name in each.names)
        required = column.default == REQUIRED
        match column.kind:
            case "key":
                return table.names_once(name)
            case "word":
                return table.words(name, column.words, "", optional=not required)
            case "flag":
                return [bool(each) for each in table.flags(name)]
            case "ref":
                if required:
                    table.names(name)
                known = self.rows(column.field).texts(TABLES[column.field].columns[0])
                named_of(table, name, dict.fromkeys(known), name)
        if column.kind in TEXTS:
            texts = table.texts(name)
            if required and "" in texts:
                raise table.cell_error(texts.index(""), name, "error.no-name", value="")
            return texts
        if column.unit_of(name) == "angle":
            values = self.angles(table, [name], infinite=column.kind == "sd")
        else:
            values = table.vectors([name], infinite=column.kind == "sd")
        if required:
            table.check_given(values, [name])
        code, valid = _NUMBERS.get(column.kind, ("", np.isreal))
        if wrong := np.flatnonzero(~(valid(values[:, 0]) | np.isnan(values[:, 0]))).tolist():
            raise table.cell_error(wrong[0], name, code, value=float(values[wrong[0], 0]))
        convert = int if column.kind == "whole" else float
        return [math.nan if math.isnan(each) else convert(each) for each in values[:, 0].tolist()]

    def unknown(
        self, table: ColumnTable, row: int, column: str, kind: type[_Kind], name: str, **fields: Any
    ) -> _Kind:
        """Return the unknown of a name, shared by all rows with this name."""
        new = made(table, row, kind, name, **fields)
        own: _Kind = self.shared.setdefault((kind, name), new)
        pairs = [(each.row()[1:], each.is_open, getattr(each, "epoch", None)) for each in (own, new)]
        if pairs[0] != pairs[1]:
            raise table.cell_error(row, column, "plain.other-values", name=name)
        return own

    def remark(self, code: str, path: Path | None = None, /, **fields: Any) -> None:
        self.messages.append(Message.of(code, path, **fields))

    def angle(self, text: str) -> float:
        """Return an angle in radians from a cell in the unit of the project."""
        return (degrees if self.settings.angle == "dms" else finite_number)(text) * self.radians

    def angles(
        self, table: ColumnTable, columns: Sequence[str], default: float = math.nan, *, infinite: bool = False
    ) -> Floats:
        """Return (rows, k) angles in radians."""
        if self.settings.angle == "dms":
            return table.vectors(columns, default, infinite=infinite, read=self.angle)
        found = table.vectors(columns, infinite=infinite) * self.radians
        return np.where(np.isnan(found), default, found)

    def matrices(self, table: ColumnTable) -> Floats:
        """Return (rows, 3, 3) attitudes A, photo to object; NaN without."""
        names = ANGLES[self.settings.attitude]
        others = [each for each in table.columns if each in ALL_ANGLES and each not in names]
        if others and not set(names) <= set(table.columns):
            fields = {"names": others, "attitude": self.settings.attitude, "columns": list(names)}
            raise table.head.error(phrase("plain.attitude-columns", **fields))
        plain = self.settings.attitude in ("quaternion", "rotation_vector", "matrix")
        values: Floats = (table.vectors if plain else partial(self.angles, table))(names)
        check_complete(table, values, phrase("plain.all-or-none", columns=list(names)))
        found = np.full((len(values), 3, 3), np.nan)
        known = np.flatnonzero(~np.isnan(values).any(axis=1))
        if len(known):
            kind = self.settings.attitude
            for row in known.tolist() if kind in ("quaternion", "matrix") else ():
                size = float(np.linalg.norm(values[row]))
                if kind == "quaternion" and not 0.99 < size < 1.01:
                    raise table.error(row, phrase("plain.quaternion", length=size))
                if kind == "matrix" and (reason := rotation_fault(values[row].reshape(3, 3))):
                    raise table.error(row, phrase("plain.rotation-matrix", reason=reason))
            given = values[known].reshape(-1, 3, 3) if kind == "matrix" else values[known]
            own = Attitudes.of(cast("Representation", kind), given).matrices
            if kind not in ("yaw_pitch_roll", "azimuth_tilt_swing"):
                # Numbers of these types define a matrix Q; the settings define its direction.
                inverse = kind in ("omega_phi_kappa", "phi_omega_kappa")
                if inverse != (self.settings.rotation == "object_to_photo"):
                    own = own.transpose(0, 2, 1)
                if self.settings.photo == "y_down":
                    own = own @ Y_DOWN
            found[known] = own
        return found

    @property
    def radians(self) -> float:
        """Radians per unit of angles."""
        return {"gon": math.pi / 200, "rad": 1.0}.get(self.settings.angle, math.pi / 180)

    @property
    def flip(self) -> Floats:
        """(3, 3) transformation from photo axes of the settings to internal axes."""
        return Y_DOWN if self.settings.photo == "y_down" else np.eye(3)

    def sd(self, table: ColumnTable, column: str, default: float = math.nan) -> Floats:
        """Return (rows,) standard deviations of a column in internal units."""
        if column.removeprefix("sd_") in ANGULAR:
            return self.angles(table, [column], default, infinite=True)[:, 0]
        return table.numbers(column, default, infinite=True)

    def deviations(
        self, table: ColumnTable, kind: str, columns: Sequence[str], default: float = math.nan
    ) -> Floats:
        """Return (rows, k) standard deviations: table, `[sd]`, or default."""
        given = self.settings.sd.get(kind)
        defaults = np.broadcast_to((default,) if given is None else given, len(columns)).tolist()
        common = table.numbers("sd", infinite=True) if "sd" in table and kind != "photos" else None
        found = np.empty((table.count, len(columns)))
        for k, column in enumerate(columns):
            if given is not None and column.removeprefix("sd_") in ANGULAR:
                defaults[k] = self.angle(repr(defaults[k]))
            own = self.sd(table, column)
            if common is not None:
                own = np.where(np.isnan(own), common, own)
            found[:, k] = np.where(np.isnan(own), defaults[k], own)
        if (found < 0).any():
            row, k = np.argwhere(found < 0)[0].tolist()
            raise table.cell_error(row, columns[k], "error.not-negative", value=float(found[row, k]))
        return found


def covariances_of(
    sd: Floats,
    table: ColumnTable | None = None,
    names: Sequence[str] = AXES,
    units: Sequence[float] | None = None,
) -> Floats:
    """Return (n, k, k) covariances of (n, k) standard deviations and cov_xy ...

    `units` are the internal units per unit of the table of each component; None: 1.
    """
    count = len(names)
    found = np.zeros((len(sd), count, count))
    found[:, range(count), range(count)] = np.asarray(sd) ** 2
    scales = (1.0,) * count if units is None else units
    if table is not None:
        for name, (i, j) in covariance_columns(names).items():
            found[:, i, j] = found[:, j, i] = scales[i] * scales[j] * table.numbers(name, 0.0)
    return found


def signs_in_files(names: Sequence[str]) -> Floats:
    """Return the signs of parameters of cameras in files relative to models.

    A principal distance is positive in files, for the positive plane, and negative in models.
    """
    return np.array([-1.0 if name == "c" else 1.0 for name in names])


def indices_of(table: ColumnTable, column: str, places: Mapping[str, int], kind: str) -> Indices:
    """Return (rows,) the index of the named object of each row."""
    found = table.names(column)
    rows = np.array([places.get(name, -1) for name in found.names], dtype=np.int64)
    if (rows < 0).any():
        missing = int(np.flatnonzero(rows < 0)[0])
        row = int(np.flatnonzero(found.rows == missing)[0])
        raise table.unknown_error(row, column, kind, found.names[missing], places)
    return rows[found.rows]


def named_of(table: ColumnTable, column: str, known: Mapping[str, _Named], kind: str) -> list[_Named | None]:
    """Return the named object of each row; None for an empty cell."""
    names = table.texts(column)
    for row, name in enumerate(names):
        if name and name not in known:
            raise table.unknown_error(row, column, kind, name, known)
    return [known.get(name) for name in names]


def check_complete(table: ColumnTable, values: Floats, message: Phrase) -> None:
    """Reject rows with only some of the numbers of a vector."""
    check_rows(table, np.isnan(values).any(axis=1) & ~np.isnan(values).all(axis=1), message)


def check_rows(table: ColumnTable, wrong: ArrayLike, message: Phrase) -> None:
    """Reject a table with wrong rows; the error names the first one."""
    if np.any(wrong):
        raise table.error(int(np.argmax(wrong)), message)


def correlations(
    covariances: Floats, names: Sequence[str], units: Sequence[float] | None = None
) -> dict[str, Any]:
    """Return covariance columns, if any; `units`: table per internal unit."""
    scales = (1.0,) * len(names) if units is None else units
    columns = covariance_columns(names)
    if not any(np.nan_to_num(covariances[:, i, j]).any() for i, j in columns.values()):
        return {}
    return {name: covariances[:, i, j] * (scales[i] * scales[j]) for name, (i, j) in columns.items()}


def columns_of(names: Sequence[str], values: Floats) -> dict[str, Any]:
    """Return (rows, k) numbers as columns, or (k,) numbers as cells, by name."""
    return dict(zip(names, values.T, strict=True))


def columns_of_records(records: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return records, as of :meth:`Tables.records`, as columns by name; empty columns are omitted."""
    rows = list(records)
    found: dict[str, Any] = {}
    for name in dict.fromkeys(name for row in rows for name in row):
        own = [row.get(name) for row in rows]
        if all(cell is None or isinstance(cell, float) for cell in own):
            found[name] = np.array(own, dtype=float)
        elif any(cell not in (None, "") for cell in own):
            found[name] = own
    return {name: own for name, own in found.items() if isinstance(own, list) or not np.isnan(own).all()}


def places_written(block: Block, values: Floats) -> Floats:
    """Return positions in the units of tables."""
    if not block.geographic:
        return values
    return np.column_stack([degrees_typed(values[:, :2]), values[:, 2]])


def angles_of(matrices: Floats, block: Block) -> Floats:
    """Return (n, 3) omega, phi, kappa (degrees) of photo axes as columns; NaN for NaN."""
    return degrees_typed(known_angles(angles_form(block.photo_to_ground), matrices), MATRIX_ROUNDING)


class Transform:
    def __init__(self, settings: Settings, messages: list[Message]) -> None:
        self.settings, self._messages = settings, messages
        self.frame = settings.frame

    def positions(
        self, name: str, values: Floats, covariances: Floats | None, table: ColumnTable
    ) -> tuple[Floats, Floats]:
        """Return (n, 3) positions in the frame, and (n, 3, 3) covariances, m2."""
        own = np.zeros((len(values), 3, 3)) if covariances is None else covariances
        crs = self.settings.crs.get(name, "")
        if not crs:
            if self.frame.kind != "geographic" and is_geographic(table):
                raise table.head.error(phrase("plain.degrees"))
            if self.frame.kind == "geographic":
                return np.column_stack([np.radians(values[:, :2]), values[:, 2]]), own
            return values, own
        from photogram.formats.crs import amid, to_frame

        if self.settings.length != "m":
            raise InputError(phrase("plain.crs-unit", unit=self.settings.length), file=self.settings.path)
        check_complete(table, values, phrase("plain.partial-position", crs=crs))
        known = ~np.isnan(values).any(axis=1)
        if not known.any():
            return values, own
        try:
            kind, origin = self.frame.kind, self.frame.origin
            if kind == "cartesian" or (kind == "topocentric" and origin is None):
                # The origin is the mean of the first positions.
                self.frame = Frame("topocentric", "EPSG:4979", amid(crs, values[known]))
                self._messages.append(Message(phrase("plain.frame", crs=crs, frame=str(self.frame))))
            found, turned, remarks = to_frame(crs, values[known], own[known], self.frame)
        except InputError as error:
            if error.file:
                raise
            raise table.head.error(phrase("plain.crs", message=message_of(error))) from None
        positions, rotated = np.full_like(values, math.nan), own.copy()
        positions[known], rotated[known] = found, turned
        self._messages += [Message(text, table.path) for text in remarks]
        return positions, rotated
