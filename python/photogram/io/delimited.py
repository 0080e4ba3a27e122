"""Tables as people write them: any usual delimiter, decimal point or comma, comments, columns in any order.

The header says what is what. A record is a line; names may stand in quotation marks. Large tables that are
well formed go through the parser of pandas; all others, and all that is at fault, are read line by line with
the same result and the place of every cell.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.io.files import read_text
from photogram.io.numbers import Marks, finite_number, marks_of
from photogram.io.places import Place
from photogram.io.rows import DELIMITERS, LONGEST_RECORD
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import listed, quoted

LARGE = 1 << 20
"""Bytes from which a table is worth the parser of pandas."""
COMMENT = "#"
TITLES = 30
"""Lines in which a header is looked for below titles."""
NAMELESS = "?"
"""The first column where each row has a cell more than the header."""
Spelling = Callable[[Sequence[str]], Sequence[str]]
_SEPARATOR = re.compile(r"sep=.", re.IGNORECASE)
"""What Excel writes before a table."""
_NUMBER = re.compile(r"[-+]?[\d.,'’ \u00a0\u202f]*(?:[eE][-+]?\d+)?")
_BLANKS = re.compile(r'"([^"]*)"|(\S+)')
TRUE, FALSE = (
    frozenset({"true", "yes", "on", "1", "t", "y"}),
    frozenset({"false", "no", "off", "0", "f", "n"}),
)


@dataclass(frozen=True)
class Names:
    """A column of names: each name once, in the order in which they come, and which one each row has."""

    names: list[str]
    rows: Indices


@dataclass(frozen=True)
class ColumnTable:
    """A table whose columns are asked for by name.

    Attributes
    ----------
    path
        The file.
    head
        The record that names the columns.
    columns
        Their names, in small letters.
    count
        How many rows there are.
    cells
        Columns of text.
    ready
        Columns that were read as numbers or names already.
    records
        Number of the record of each row.
    numeric
        Columns whose cells together show how the table writes numbers.
    own
        What the file calls the columns, in small letters; empty for one that it does not name.
    """

    path: Path
    head: Place
    columns: tuple[str, ...]
    count: int
    cells: Mapping[str, Sequence[str]]
    records: Sequence[int]
    delimiter: str = ","
    ready: Mapping[str, Floats | Names] = field(default_factory=dict)
    numeric: frozenset[str] = frozenset()
    own: tuple[str, ...] = ()

    def __contains__(self, column: str) -> bool:
        return column in self.columns

    @property
    def headings(self) -> list[tuple[str, str]]:
        """What each column is called here, and in the file, as far as it names them."""
        return list(zip(self.columns, self.own or self.columns, strict=True))

    @cached_property
    def _lines(self) -> list[str]:
        return [] if self.path.suffix == ".parquet" else read_text(self.path).split("\n")

    @cached_property
    def _marks(self) -> Marks:
        numbers = [cells for name, cells in self.cells.items() if name in self.numeric]
        return marks_of((cell for column in numbers for cell in column), self.delimiter)

    def place(self, row: int) -> Place:
        """Return where a row stands."""
        record = self.records[row]
        text = self._lines[record - 1] if record <= len(self._lines) else None
        return Place(self.path, record, text)

    def error(self, row: int, message: str) -> InputError:
        """Return an error that names the place of a row."""
        return self.place(row).error(message)

    def renamed(self, names: Mapping[str, str]) -> ColumnTable:
        """Return the table with other names of some columns."""
        columns = tuple(names.get(column, column) for column in self.columns)
        cells = {names.get(column, column): own for column, own in self.cells.items()}
        ready = {names.get(column, column): own for column, own in self.ready.items()}
        return replace(self, columns=columns, cells=cells, ready=ready)

    def some(self, rows: Sequence[int]) -> ColumnTable:
        """Return the table with some of its rows, in this order."""
        cells = {column: [own[row] for row in rows] for column, own in self.cells.items()}
        ready = {
            column: Names(own.names, own.rows[rows]) if isinstance(own, Names) else own[rows]
            for column, own in self.ready.items()
        }
        records = [self.records[row] for row in rows]
        return replace(self, count=len(rows), cells=cells, ready=ready, records=records)

    def with_texts(self, column: str, texts: Sequence[str]) -> ColumnTable:
        """Return the table with other texts in a column."""
        ready = {name: own for name, own in self.ready.items() if name != column}
        return replace(self, cells={**self.cells, column: texts}, ready=ready)

    def require(self, *columns: str) -> None:
        """Refuse a table without these columns.

        Raises
        ------
        InputError
            Those that are missing, beside those that are there.
        """
        if missing := [column for column in columns if column not in self.columns]:
            what = "the column {} is missing" if len(missing) == 1 else "the columns {} are missing"
            raise self.head.error(f"{what.format(listed(missing))}; there are {listed(list(self.columns))}")

    def names(self, column: str) -> Names:
        """Return a column of names, without blanks at both ends.

        Raises
        ------
        InputError
            A cell that is empty or says NaN, names that differ by inner blanks or by case alone.
        """
        found = self.ready.get(column)
        if not isinstance(found, Names):
            found = _factorised(self._cells(column))
        if _all_apart(found.names):
            return found
        for name in found.names:
            if not name or name.lower() == "nan":
                row = int(np.flatnonzero(found.rows == found.names.index(name))[0])
                raise self.error(
                    row, f"column {column}: {'is empty' if not name else f'{name!r} is no name'}"
                )
        self._check_alike(column, found)
        return found

    def _check_alike(self, column: str, found: Names) -> None:
        seen: dict[str, int] = {}
        for place, name in enumerate(found.names):
            plain = "".join(name.split()).casefold()
            other = seen.setdefault(plain, place)
            if other != place:
                row = int(np.flatnonzero(found.rows == place)[0])
                raise self.error(
                    row,
                    f"column {column}: {quoted(name)} differs from {quoted(found.names[other])} by blanks or"
                    " case alone",
                )

    def names_once(self, column: str) -> list[str]:
        """Return a column of names as :meth:`names` has them, none of which may stand in two rows.

        Raises
        ------
        InputError
            As of :meth:`names`; a name that is there twice.
        """
        found, texts = self.names(column), self.texts(column)
        if len(found.names) < self.count:
            _, first = np.unique(found.rows, return_index=True)
            row = int(np.setdiff1d(np.arange(self.count), first)[0])
            raise self.error(row, f"the {column} {quoted(texts[row])} is there twice")
        return texts

    def texts(self, column: str, default: str = "") -> list[str]:
        """Return a column of text, without blanks at both ends; empty cells have the default."""
        found = self.ready.get(column)
        if isinstance(found, Names):
            return [found.names[row] or default for row in found.rows]
        if column not in self.columns:
            return [default] * self.count
        return [cell or default for cell in self._cells(column)]

    def _cells(self, column: str) -> Sequence[str]:
        """Return the cells of a column of text: none are numbers of a Parquet file, unless all are empty."""
        numbers = self.ready.get(column)
        if numbers is None:
            return self.cells[column]
        if not np.isnan(numbers).all():  # type: ignore[arg-type]
            raise self.head.error(
                f"the column {column} holds numbers with decimals: names and words are text or whole numbers"
            )
        return [""] * self.count

    def numbers(
        self,
        column: str,
        default: float = math.nan,
        *,
        infinite: bool = False,
        read: Callable[[str], float] | None = None,
    ) -> Floats:
        """Return (rows,) a column of numbers.

        Parameters
        ----------
        column
            Its name.
        default
            For empty cells, and where the column is missing.
        infinite
            Whether `inf` is a number here.
        read
            Reads a cell in place of a plain number.

        Raises
        ------
        InputError
            A cell that is no such number; names file, record and column.
        """
        found = self.ready.get(column)
        if isinstance(found, np.ndarray):
            return self._known(column, found, default, infinite=infinite, read=read)
        if column not in self.columns:
            return np.full(self.count, default)
        convert = finite_number if read is None else read
        marks = self._marks if column in self.numeric else marks_of(self.cells[column], self.delimiter)
        values = np.empty(self.count)
        for row, cell in enumerate(self.texts(column)):
            if not cell:
                values[row] = default
                continue
            if infinite and cell.lower() in ("inf", "+inf", "infinity"):
                values[row] = math.inf
                continue
            try:
                values[row] = convert(marks.plain(cell))
            except ValueError as error:
                raise self.error(row, f"column {column}: {error}") from None
        return values

    def _known(
        self,
        column: str,
        found: Floats,
        default: float,
        *,
        infinite: bool,
        read: Callable[[str], float] | None,
    ) -> Floats:
        """Return numbers that the file has as such, as :meth:`numbers` has them; NaN stands for empty."""
        if not infinite and np.isinf(found).any():
            raise self.error(int(np.argmax(np.isinf(found))), f"column {column}: is not a finite number")
        if read is not None:
            return np.array([default if np.isnan(each) else read(repr(each)) for each in found.tolist()])
        return found if np.isnan(default) else np.where(np.isnan(found), default, found)

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

    def given(self, columns: Sequence[str], why: str = "is empty") -> Floats:
        """Return (rows, k) k columns of numbers, none of which may be missing; see :meth:`check_given`."""
        found = self.vectors(columns)
        self.check_given(found, columns, why)
        return found

    def check_given(self, values: Floats, columns: Sequence[str], why: str = "is empty") -> None:
        """Refuse NaN among (rows, k) numbers of some columns.

        Raises
        ------
        InputError
            There is one; names file, record and column.
        """
        missing = np.argwhere(np.isnan(values))
        if len(missing):
            row, column = missing[0].tolist()
            raise self.error(row, f"column {columns[column]}: {why}")

    def words(self, column: str, known: Sequence[str], default: str | None = None) -> list[str]:
        """Return a column of some known words in small letters; empty cells have the default, or the first.

        Raises
        ------
        InputError
            Another word.
        """
        found = [each.lower() for each in self.texts(column, known[0] if default is None else default)]
        for row, word in enumerate(found):
            if word not in known:
                raise self.error(row, f"column {column}: {quoted(word)} is none of {', '.join(known)}")
        return found

    def flags(self, column: str) -> Bools:
        """Return (rows,) a column of true and false (yes, no, on, off, 1, 0); empty cells are true.

        Raises
        ------
        InputError
            Another word.
        """
        values = np.ones(self.count, dtype=bool)
        if column in self.columns:
            for row, cell in enumerate(self.texts(column)):
                word = cell.lower()
                if word and word not in TRUE | FALSE:
                    raise self.error(row, f"column {column}: {quoted(cell)} is neither true nor false")
                values[row] = not word or word in TRUE
        return values


def read_columns(
    path: Path,
    *,
    known: Collection[str] = (),
    numbers: Collection[str] = (),
    spelling: Spelling = tuple,
    hint: Callable[[Sequence[str]], str] | None = None,
) -> ColumnTable:
    """Read a table.

    Parameters
    ----------
    path
        The file: text, or Parquet by its ending.
    known
        Columns of which a header has one at least: it may then begin with the mark of a comment.
    numbers
        Columns that are numbers where they are there: for the parser of large tables.
    spelling
        Gives the names of all columns from what the file calls them, in small letters.
    hint
        What is said of a first record that names no known column; None: that it does not.

    Raises
    ------
    InputError
        The file cannot be read, holds no table, two columns have one name, a row has more or fewer cells than
        the header.
    """
    if path.suffix == ".parquet":
        return _parquet(path, spelling, numbers)
    text = read_text(path)
    head, delimiter = _head(path, text, known, spelling, hint)
    own = _lowered(head, delimiter)
    names = _named(head, own, spelling, settled=hint is not None)
    return _below(path, text, head, own, names, delimiter, numbers)


def _named(head: Place, own: Sequence[str], spelling: Spelling, *, settled: bool = False) -> tuple[str, ...]:
    """Return the names of all columns; `settled` where a user may say which of two is one."""
    columns = tuple(spelling(own))
    for column in columns:
        if column and columns.count(column) > 1:
            both = [raw for raw, name in zip(own, columns, strict=True) if name == column]
            what = f"is there twice: {listed(both)}" if set(both) != {column} else "is there twice"
            if settled and len(set(both)) > 1:
                what += f": --columns {column}={both[0]}, or {column}={both[1]}, says which it is"
            raise head.error(f"the column {quoted(column)} {what}")
    return columns


def read_rows(path: Path, columns: Sequence[str], *, numbers: Collection[str] = ()) -> ColumnTable:
    """Read a table whose columns are known, after any comments, titles and headers.

    Parameters
    ----------
    path
        The file.
    columns
        Their names; empty for those that nobody asks for.
    numbers
        As in :func:`read_columns`.

    Raises
    ------
    InputError
        The file cannot be read, or a row has more or fewer cells than there are columns.
    """
    text = read_text(path)
    lines = text.split("\n")
    filled = [row for row, line in enumerate(lines) if line.strip() and not line.lstrip().startswith(COMMENT)]
    first = next(
        (row for row in filled[:TITLES] if _fits(Place(path, row + 1, lines[row]), columns, numbers)), 0
    )
    first = first or (filled[0] if filled else 0)
    head = Place(path, first)
    sample = Place(path, first + 1, lines[first])
    return _below(path, text, head, tuple(columns), tuple(columns), _delimiter(sample), numbers)


def _below(
    path: Path,
    text: str,
    head: Place,
    own: tuple[str, ...],
    columns: tuple[str, ...],
    delimiter: str,
    numbers: Collection[str],
) -> ColumnTable:
    """Read what stands below the record of the header."""
    assert head.record is not None
    if len(text) > LARGE and delimiter != " ":
        fast = _by_pandas(path, text, head, columns, delimiter, numbers)
        if fast is not None:
            return replace(fast, own=own)
    rows, records = _by_lines(path, text.split("\n"), head.record, columns, delimiter, numbers)
    if rows and len(rows[0]) > len(columns):
        own, columns = ("", *own), (NAMELESS, *columns)
    cells = {name: [row[k] for row in rows] for k, name in enumerate(columns) if name}
    numeric = frozenset(numbers).intersection(columns)
    return ColumnTable(path, head, columns, len(rows), cells, records, delimiter, {}, numeric, own)


def _head(
    path: Path,
    text: str,
    known: Collection[str],
    spelling: Spelling,
    hint: Callable[[Sequence[str]], str] | None,
) -> tuple[Place, str]:
    """Find the header: the first line, or the last comment before it where only that names known columns.

    Lines of titles may stand before it: then it is the first below them that names several known columns.
    """
    comment: Place | None = None
    for record, line in enumerate(_lines(text), 1):
        if line.lstrip().startswith(COMMENT):
            comment = Place(path, record, line.lstrip()[1:])
            continue
        if not line.strip(" \t,;|") or _SEPARATOR.fullmatch(line):
            continue
        head = Place(path, record, line)
        for place in (head, comment):
            if place is not None and known and _knows(place, known, spelling):
                return place, _delimiter(place)
        if known and comment is None:
            if (below := _below_titles(path, text, record, known, spelling)) is not None:
                return below, _delimiter(below)
            if hint is not None:
                raise head.error(hint([cell.strip() for cell in _split(head, _delimiter(head))]))
            raise head.error(f"is no header: it names none of the columns {listed(sorted(known))}")
        return head, _delimiter(head)
    if comment is not None and _knows(comment, known, spelling):
        return comment, _delimiter(comment)
    raise Place(path).error("holds no table")


def _below_titles(
    path: Path, text: str, first: int, known: Collection[str], spelling: Spelling
) -> Place | None:
    for record, line in enumerate(islice(_lines(text), TITLES), 1):
        place = Place(path, record, line)
        if record > first and len(set(known).intersection(_spelled(place, spelling))) > 2:
            return place
    return None


def _lines(text: str) -> Iterator[str]:
    """Yield the lines of a text, without a copy of what nobody asks for."""
    start = 0
    while (end := text.find("\n", start)) >= 0:
        yield text[start:end]
        start = end + 1
    if start < len(text):
        yield text[start:]


def _lowered(place: Place, delimiter: str) -> tuple[str, ...]:
    return tuple(cell.strip().lower() for cell in _split(place, delimiter))


def _spelled(place: Place, spelling: Spelling) -> Sequence[str]:
    return spelling(_lowered(place, _delimiter(place)))


def _knows(place: Place, known: Collection[str], spelling: Spelling) -> bool:
    return not set(known).isdisjoint(_spelled(place, spelling))


def _delimiter(head: Place) -> str:
    outside = re.sub(r'"[^"]*"', "", head.text or "")
    for each in DELIMITERS:
        if each in outside:
            return each
    return " " if len(outside.split()) > 1 else ","


def _split(place: Place, delimiter: str) -> list[str]:
    text = place.text or ""
    if len(text) > LONGEST_RECORD:
        raise place.error(f"a record of {len(text)} characters; {LONGEST_RECORD} are the most")
    if delimiter == " ":
        return [whole or bare for whole, bare in _BLANKS.findall(text)]
    if '"' not in text:
        return [cell.strip() for cell in text.split(delimiter)]
    try:
        return [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))]
    except (csv.Error, StopIteration) as error:
        raise place.error(f"cannot be split into cells: {error}") from None


def _by_lines(
    path: Path,
    lines: Sequence[str],
    head: int,
    columns: Sequence[str],
    delimiter: str,
    numbers: Collection[str],
) -> tuple[list[list[str]], list[int]]:
    """Split the lines below a header into rows, all as wide as the columns.

    Where they have one cell more, the first has no name if the names would else stand over no numbers.
    """
    rows, records = list[list[str]](), list[int]()
    width = len(columns)
    for record in range(head + 1, len(lines) + 1):
        line = lines[record - 1]
        if not line.strip() or line.lstrip().startswith(COMMENT):
            continue
        place = Place(path, record, line)
        cells = _split(place, delimiter)
        if len(cells) != width:
            # A delimiter at the end of every line is one cell too many, and empty.
            if len(cells) == width + 1 and not cells[-1]:
                cells.pop()
            elif not rows and len(cells) == width + 1 and _shifted(cells, columns, numbers):
                width += 1
            else:
                raise place.error(f"there are {len(cells)} cells under {width} columns")
        rows.append(cells)
        records.append(record)
    return rows, records


def _fits(place: Place, columns: Sequence[str], numbers: Collection[str]) -> bool:
    """Whether a record has as many cells as there are columns, and numbers where they are numbers."""
    cells = _split(place, _delimiter(place))
    return len(cells) == len(columns) and all(
        _NUMBER.fullmatch(cell) is not None
        for column, cell in zip(columns, cells, strict=True)
        if column in numbers
    )


def _shifted(cells: Sequence[str], columns: Sequence[str], numbers: Collection[str]) -> bool:
    """Whether columns stand over numbers if the first cell has no column, and must, for they would not."""
    numeric = [k for k, column in enumerate(columns) if column in numbers]
    as_is, shifted = (
        all(_NUMBER.fullmatch(cells[k + step]) or not cells[k + step] for k in numeric) for step in (0, 1)
    )
    return shifted and (not as_is or len(numeric) == len(columns))


def _by_pandas(
    path: Path,
    text: str,
    head: Place,
    columns: Sequence[str],
    delimiter: str,
    numbers: Collection[str],
) -> ColumnTable | None:
    """Read a large table; None where anything is not as it should be: the other way says what."""
    import pandas as pd

    assert head.record is not None
    start = 0
    for _ in range(head.record):
        start = text.find("\n", start) + 1
    body = text[start:].rstrip("\n")
    if not body or not all(columns) or body.startswith(COMMENT) or "\n" + COMMENT in body:
        return None
    count = body.count("\n") + 1
    kinds = {each: float if each in numbers else str for each in columns}
    # From version 3 on pandas reads every number to the last bit, and does not want to be asked.
    exact: dict[str, Any] = (
        {} if int(pd.__version__.partition(".")[0]) >= 3 else {"float_precision": "round_trip"}
    )
    sample = _split(Place(path, text=body.partition("\n")[0]), delimiter)
    comma = delimiter != "," and any(
        "," in cell for each, cell in zip(columns, sample, strict=False) if each in numbers
    )
    form: dict[str, Any] = {
        "header": None,
        "index_col": False,
        "decimal": "," if comma else ".",
        "keep_default_na": False,
        "na_values": [""],
        "skipinitialspace": True,
        "skip_blank_lines": False,
        "engine": "c",
        **exact,
    }
    try:
        frame = pd.read_csv(
            io.BytesIO(body.encode()), sep=delimiter, names=list(columns), dtype=kinds, **form
        )
    except (ValueError, OverflowError, pd.errors.ParserError, pd.errors.ParserWarning):
        return None
    if len(frame) != count:
        return None
    ready: dict[str, Floats | Names] = {}
    empty = False
    for each in columns:
        if each in numbers:
            values = frame[each].to_numpy()
            if np.isinf(values).any():
                return None
            empty = empty or bool(np.isnan(values).any())
            ready[each] = values
        else:
            codes, texts = pd.factorize(frame[each])
            if (codes < 0).any():
                return None
            ready[each] = _merged(codes.astype(np.int64), [str(text).strip() for text in texts])
    if empty and not _empty_cells(body, delimiter, count, len(columns)):
        return None
    records = range(head.record + 1, head.record + 1 + count)
    return ColumnTable(path, head, tuple(columns), count, {}, records, delimiter, ready)


def _empty_cells(body: str, delimiter: str, count: int, width: int) -> bool:
    """Whether all that pandas has no number of must be empty cells: no row is short, and none says NaN."""
    whole = '"' not in body and body.count(delimiter) == count * (width - 1)
    return whole and "nan" not in body.casefold()


def _all_apart(names: Sequence[str]) -> bool:
    """Whether names are surely all right: without blanks, and different when case is put aside."""
    text = "\n".join(names).casefold()
    words = text.split()
    if len(words) < len(names) or text.count("\n") >= len(names):
        return False
    different = set(words)
    return len(different) == len(names) == len(words) and "nan" not in different


def _merged(codes: Indices, texts: list[str]) -> Names:
    """Return names of which those that were alike but for blanks at their ends are one."""
    if len(set(texts)) == len(texts):
        return Names(texts, codes)
    found = _factorised(texts)
    return Names(found.names, found.rows[codes])


def _factorised(cells: Sequence[str]) -> Names:
    places: dict[str, int] = {}
    rows = np.fromiter((places.setdefault(cell, len(places)) for cell in cells), np.int64, len(cells))
    return Names(list(places), rows)


def _parquet(path: Path, spelling: Spelling, numbers: Collection[str]) -> ColumnTable:
    import pyarrow
    import pyarrow.compute
    import pyarrow.parquet

    try:
        table = pyarrow.parquet.read_table(path)
    except (OSError, pyarrow.ArrowException) as error:
        raise InputError(f"cannot be read as Parquet: {error}", file=path) from None
    head = Place(path)
    own = tuple(name.strip().lower() for name in table.column_names)
    columns = _named(head, own, spelling)
    ready: dict[str, Floats | Names] = {}
    cells: dict[str, Sequence[str]] = {}
    for name, column in zip(columns, table.columns, strict=True):
        kind = column.type
        if pyarrow.types.is_integer(kind) and name not in numbers:
            # Names that are digits all of them.
            column, kind = column.cast(pyarrow.string()), pyarrow.string()
        if pyarrow.types.is_large_string(kind):
            column, kind = column.cast(pyarrow.string()), pyarrow.string()
        if pyarrow.types.is_dictionary(kind) or pyarrow.types.is_string(kind):
            whole = column.unify_dictionaries().combine_chunks()
            coded = whole if pyarrow.types.is_dictionary(kind) else pyarrow.compute.dictionary_encode(whole)
            texts = [str(text).strip() for text in coded.dictionary.to_pylist()]
            codes = coded.indices.fill_null(-1).to_numpy(zero_copy_only=False).astype(np.int64)
            if (codes < 0).any():
                texts.append("")
                codes = np.where(codes < 0, len(texts) - 1, codes)
            ready[name] = _merged(codes, texts)
        elif pyarrow.types.is_floating(kind) or pyarrow.types.is_integer(kind):
            ready[name] = column.to_numpy().astype(float)
        else:
            cells[name] = ["" if each is None else str(each) for each in column.to_pylist()]
    records = range(1, table.num_rows + 1)
    return ColumnTable(path, head, columns, table.num_rows, cells, records, ready=ready, own=own)
