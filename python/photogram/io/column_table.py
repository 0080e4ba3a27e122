"""Columns of a table on demand: names, numbers, words, with locations for errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError, message_of
from photogram.io.files import read_text
from photogram.io.numbers import Marks, finite_number, marks_of, whole_number
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import missing_columns, unknown_name
from photogram.words import Phrase, phrase

COMMENT = "#"  # First character of comments
TRUE, FALSE = (
    frozenset({"true", "yes", "on", "1", "t", "y"}),
    frozenset({"false", "no", "off", "0", "f", "n"}),
)


@dataclass(frozen=True, eq=False)
class NameColumn:
    """A column of names: different names in order, and the name of each row.

    `distinct` is True if no name is empty, and all differ by more than blanks and case.
    """

    names: list[str]
    rows: Indices
    distinct: bool = False

    def __len__(self) -> int:
        return len(self.rows)

    def some(self, rows: Sequence[int]) -> NameColumn:
        """Return the names of selected rows, in this order."""
        kept, codes = np.unique(self.rows[rows], return_inverse=True)
        return NameColumn([self.names[code] for code in kept.tolist()], codes.reshape(-1), self.distinct)


Cells = Sequence[str] | NameColumn | Floats


class TableRow(NamedTuple):
    """A row, whose location is found on demand."""

    table: ColumnTable
    row: int

    def error(self, message: str | Phrase) -> InputError:
        """Return an error with the location of the row."""
        return self.table.error(self.row, message)


@dataclass(frozen=True)
class ColumnTable:
    """A table with access to columns by name."""

    path: Path  # The file
    head: Place  # Record with the column names
    columns: tuple[str, ...]  # Column names in small letters
    count: int  # Number of rows
    cells: Mapping[str, Cells]  # Columns: texts, or already numbers or names
    records: Sequence[int]  # Number of the record of each row
    delimiter: str = ","
    # Number format of columns of texts that have it in common
    marks: Mapping[str, Marks] = field(default_factory=dict)
    # Names of the columns in the file, in small letters; empty for unnamed ones
    own: tuple[str, ...] = ()

    def __contains__(self, column: str) -> bool:
        return column in self.columns

    @property
    def headings(self) -> list[tuple[str, str]]:
        """Internal name and name in the file of each column."""
        return list(zip(self.columns, self.own or self.columns, strict=True))

    @property
    def comments(self) -> list[Place]:
        lines = enumerate(self._lines, 1)
        return [Place(self.path, row, line) for row, line in lines if line.lstrip().startswith(COMMENT)]

    @cached_property
    def _lines(self) -> list[str]:
        return [] if self.path.suffix == ".parquet" else read_text(self.path).split("\n")

    def place(self, row: int) -> Place:
        """Return the location of a row."""
        record = self.records[row]
        text = self._lines[record - 1] if record <= len(self._lines) else None
        return Place(self.path, record, text)

    def error(self, row: int, message: str | Phrase) -> InputError:
        """Return an error with the location of a row."""
        return self.place(row).error(message)

    def at(self, row: int) -> TableRow:
        """Return a row as a location for errors."""
        return TableRow(self, row)

    def cell_error(self, row: int, column: str, code: str, **fields: Any) -> InputError:
        return self.error(row, phrase("error.column", column=column, message=Phrase(code, fields)))

    def unknown_error(
        self, row: int, column: str, kind: str, name: str, names: Collection[str]
    ) -> InputError:
        """Return the error of a name that does not exist."""
        message = unknown_name(kind, name, names)
        return self.error(row, phrase("error.column", column=column, message=message))

    def renamed(self, names: Mapping[str, str]) -> ColumnTable:
        columns = tuple(names.get(column, column) for column in self.columns)
        cells = {names.get(column, column): own for column, own in self.cells.items()}
        return replace(self, columns=columns, cells=cells)

    def some(self, rows: Sequence[int]) -> ColumnTable:
        """Return the table with selected rows, in this order."""
        cells: dict[str, Cells] = {}
        for column, own in self.cells.items():
            if isinstance(own, NameColumn):
                cells[column] = own.some(rows)
            else:
                cells[column] = own[rows] if isinstance(own, np.ndarray) else [own[row] for row in rows]
        records = [self.records[row] for row in rows]
        return replace(self, count=len(rows), cells=cells, records=records)

    def joined(self, other: ColumnTable) -> ColumnTable:
        """Return the table with the rows of another batch of its file."""
        cells: dict[str, Cells] = {}
        for column, own in self.cells.items():
            more = other.cells[column]
            if isinstance(own, np.ndarray):
                cells[column] = np.append(own, more)  # type: ignore[arg-type]
            else:
                cells[column] = [*self.texts(column), *other.texts(column)]
        records = [*self.records, *other.records]
        return replace(self, count=self.count + other.count, cells=cells, records=records)

    def with_texts(self, column: str, texts: Sequence[str]) -> ColumnTable:
        return replace(self, cells={**self.cells, column: texts})

    def require(self, *columns: str) -> None:
        """Reject a table without these columns."""
        if missing := [column for column in columns if column not in self.columns]:
            raise self.head.error(missing_columns(missing, self.columns))

    def names(self, column: str) -> NameColumn:
        """Return a column of names, without outer blanks."""
        cells = self._texts(column)
        found = cells if isinstance(cells, NameColumn) else factorised(cells)
        if found.distinct:
            return found
        text = "\n".join(found.names).casefold()
        words = text.split()
        # Nearly all columns: names without blanks that differ, also by more than case
        is_plain = len(words) == len(found.names) and text.count("\n") < len(words)
        if is_plain and len({*words, "nan"}) > len(words):
            return found
        for name in found.names:
            if not name or name.lower() == "nan":
                row = int(np.flatnonzero(found.rows == found.names.index(name))[0])
                raise self.cell_error(row, column, "error.no-name", value=name)
        seen: dict[str, int] = {}
        for place, name in enumerate(found.names):
            plain = "".join(name.split()).casefold()
            other = seen.setdefault(plain, place)
            if other != place:
                row = int(np.flatnonzero(found.rows == place)[0])
                raise self.cell_error(row, column, "cells.similar", name=name, other=found.names[other])
        return found

    def names_once(self, column: str) -> list[str]:
        """Return a column of names as :meth:`names` does; reject repeated names."""
        found, texts = self.names(column), self.texts(column)
        if len(found.names) < self.count:
            _, first = np.unique(found.rows, return_index=True)
            row = int(np.setdiff1d(np.arange(self.count), first)[0])
            raise self.error(row, phrase("error.repeated", kind=column.replace("_", " "), name=texts[row]))
        return texts

    def texts(self, column: str, default: str = "") -> list[str]:
        """Return a column of text, without outer blanks; empty cells have the default."""
        if column not in self.columns:
            return [default] * self.count
        found = self._texts(column)
        if isinstance(found, NameColumn):
            return [found.names[row] or default for row in found.rows]
        return [cell or default for cell in found]

    def _texts(self, column: str) -> Sequence[str] | NameColumn:
        """Return the texts of a column; reject numbers."""
        cells = self.cells[column]
        if not isinstance(cells, np.ndarray):
            return cells
        if not np.isnan(cells).all():
            raise self.head.error(phrase("cells.decimals", column=column))
        return [""] * self.count

    def numbers(
        self,
        column: str,
        default: float = math.nan,
        *,
        infinite: bool = False,
        read: Callable[[str], float] | None = None,
    ) -> Floats:
        """Return (rows,) a column of numbers, with `default` for missing cells.

        `infinite` permits `inf`; `read` replaces :func:`finite_number`.
        """
        found = self.cells.get(column)
        if isinstance(found, np.ndarray):
            # The file contains numbers; NaN is an empty cell.
            if not infinite and np.isinf(found).any():
                row = int(np.argmax(np.isinf(found)))
                raise self.cell_error(row, column, "error.finite", value=float(found[row]))
            if read is not None:
                return np.array([default if np.isnan(each) else read(repr(each)) for each in found.tolist()])
            return found if np.isnan(default) else np.where(np.isnan(found), default, found)
        if column not in self.columns:
            return np.full(self.count, default)
        convert = finite_number if read is None else read
        cells = self.texts(column)
        marks = self.marks.get(column) or marks_of(cells, self.delimiter)
        values = np.empty(self.count)
        for row, cell in enumerate(cells):
            if not cell:
                values[row] = default
                continue
            if infinite and cell.lower() in ("inf", "+inf", "infinity"):
                values[row] = math.inf
                continue
            try:
                values[row] = convert(marks.plain(cell))
            except ValueError as error:
                message = message_of(error)
                raise self.error(row, phrase("error.column", column=column, message=message)) from None
        return values

    def wholes(self, column: str, default: int | None = None) -> Indices:
        """Return (rows,) integers that are not negative, with `default` for missing cells."""
        read = partial(whole_number, highest=2**53)  # Exact as numbers
        values = self.numbers(column, math.nan if default is None else default, read=read)
        self.check_given(values[:, np.newaxis], [column])
        return values.astype(np.int64)

    def vectors(
        self,
        columns: Sequence[str],
        default: float = math.nan,
        *,
        infinite: bool = False,
        read: Callable[[str], float] | None = None,
    ) -> Floats:
        """Return (rows, k) k columns of numbers; see :meth:`numbers`."""
        found = [self.numbers(each, default, infinite=infinite, read=read) for each in columns]
        return np.stack(found, axis=1)

    def given(self, columns: Sequence[str]) -> Floats:
        """Return (rows, k) k columns of numbers; reject missing ones."""
        values = self.vectors(columns)
        self.check_given(values, columns)
        return values

    def check_given(self, values: Floats, columns: Sequence[str], table: str = "") -> None:
        """Reject NaN in (rows, k) numbers; `[sd]` may replace columns of `table`."""
        missing = np.argwhere(np.isnan(values))
        if len(missing):
            row, column = missing[0].tolist()
            code = "cells.no-sd" if table else "error.empty"
            raise self.cell_error(row, columns[column], code, table=table)

    def words(
        self, column: str, known: Sequence[str], default: str | None = None, *, optional: bool = False
    ) -> list[str]:
        """Return a column of known words in small letters.

        If `optional`, the default of empty cells may be another word.
        """
        words = [word.lower() for word in self.texts(column, known[0] if default is None else default)]
        for row, word in enumerate(words):
            if word not in known and not (optional and word == default):
                raise self.cell_error(row, column, "error.choice", names=list(known), value=word)
        return words

    def flags(self, column: str) -> Bools:
        """Return (rows,) a column of true or false; empty cells are true."""
        if column not in self.columns:
            return np.ones(self.count, dtype=bool)
        cells = self.texts(column)
        for row, cell in enumerate(cells):
            if cell and cell.lower() not in TRUE | FALSE:
                raise self.cell_error(row, column, "error.flag", value=cell)
        return np.array([cell.lower() not in FALSE for cell in cells], dtype=bool)


def merged(codes: Indices, texts: list[str]) -> NameColumn:
    """Return names in which equal ones, ignoring outer blanks, are merged."""
    if len(set(texts)) == len(texts):
        return NameColumn(texts, codes)
    found = factorised(texts)
    return NameColumn(found.names, found.rows[codes])


def factorised(cells: Sequence[str]) -> NameColumn:
    """Return the different names in the order of their first rows."""
    places: dict[str, int] = {}
    rows = np.fromiter((places.setdefault(cell, len(places)) for cell in cells), np.int64, len(cells))
    return NameColumn(list(places), rows)
