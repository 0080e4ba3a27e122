"""Reader of text tables with any usual delimiter and column order.

The header defines the columns. A record is a line; names may have quotation marks. The extension module reads
large tables of regular lines. All other tables, and tables with errors, are read line by line with the same
result and the location of every cell.
"""

from __future__ import annotations

import codecs
import csv
import itertools
import re
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.errors import InputError
from photogram.io.column_table import COMMENT, Cells, ColumnTable, NameColumn, merged
from photogram.io.files import decoded, read_beginning, read_lines, read_text, reading
from photogram.io.numbers import marks_of
from photogram.io.places import Place
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    import pyarrow

DELIMITERS = ("\t", ";", ",", "|")  # Possible delimiters in a header, in order of priority
LONGEST_RECORD = 100_000  # Characters of a record; the module `csv` rejects cells above 131,072
LARGE = 1 << 16  # Size (bytes) of a table above which the extension module reads it
PIECE = 1 << 22  # Bytes of a large table per read
BATCH = 1 << 25  # Approximate bytes of a batch
ROW = 1 << 5  # Bytes of a row of Parquet in a batch
TITLES = 30  # Number of lines below titles that are searched for a header
NAMELESS = "?"  # The first column if each row has one cell more than the header
Spelling = Callable[[Sequence[str]], Sequence[str]]
_SEPARATOR = re.compile(r"sep=.", re.IGNORECASE)  # First line of tables from Excel
_NUMBER = re.compile(r"[-+]?[\d.,'’ \u00a0\u202f]*(?:[eE][-+]?\d+)?")
_BLANKS = re.compile(r'"([^"]*)"|(\S+)')
_LINE = re.compile(r"(.*)\n?")


def read_columns(
    path: Path,
    *,
    known: Collection[str] = (),
    numbers: Collection[str] = (),
    spelling: Spelling = tuple,
) -> ColumnTable:
    """Read a table from a text or Parquet file.

    A header contains at least one of the `known` columns: it may then begin with the mark of a comment. The
    reader of large tables requires the columns of `numbers`. `spelling` returns the names of all columns from
    those in the file (in small letters).
    """
    return next(read_batches(path, known=known, numbers=numbers, spelling=spelling, size=None))


def read_batches(
    path: Path,
    *,
    known: Collection[str] = (),
    numbers: Collection[str] = (),
    spelling: Spelling = tuple,
    hint: Callable[[Sequence[str]], str | Phrase] | None = None,
    size: int | None = BATCH,
) -> Iterator[ColumnTable]:
    """Yield a table in batches of about `size` bytes; arguments as in :func:`read_columns`.

    There is at least one batch. A table with decimal commas or irregular lines is one batch. `hint` returns
    the error of a first record without a known column.
    """
    if path.suffix == ".parquet":
        with reading(path):
            return _parquet(path, spelling, numbers, size)

    def header(text: str) -> _Header:
        head = _head(path, text, known, spelling, hint)
        own = _names(head)
        return head, own, _named(head, own, spelling, settled=hint is not None), _delimiter(head)

    return _read(path, header, numbers, size)


def read_head(path: Path, known: Collection[str] = (), spelling: Spelling = tuple) -> list[str]:
    """Return the names of the columns in a file, in small letters; see :func:`read_columns`."""
    if path.suffix == ".parquet":
        import pyarrow.parquet

        return [name.strip().lower() for name in pyarrow.parquet.read_schema(path).names]
    return [*_names(_head(path, read_beginning(path), known, spelling, None))]


def _named(head: Place, own: Sequence[str], spelling: Spelling, *, settled: bool = False) -> tuple[str, ...]:
    """Return the names of all columns; `settled`: the user may choose."""
    columns = tuple(spelling(own))
    for column in columns:
        if column and columns.count(column) > 1:
            both = [raw for raw, name in zip(own, columns, strict=True) if name == column]
            if settled and len(set(both)) > 1:
                raise head.error(phrase("cells.same-columns", column=column, names=both, first=both[0]))
            raise head.error(phrase("error.repeated", kind="column", name=column))
    return columns


def read_rows(path: Path, columns: Sequence[str], *, numbers: Collection[str] = ()) -> ColumnTable:
    """Read a table whose columns are known, after any comments, titles and headers.

    Unused columns have empty names; `numbers` as in :func:`read_columns`.
    """

    def header(text: str) -> _Header:
        lines = text.split("\n")
        filled = [
            row for row, line in enumerate(lines) if line.strip() and not line.lstrip().startswith(COMMENT)
        ]
        places = [Place(path, row + 1, lines[row]) for row in filled[:TITLES] or [0]]
        for place in places:
            cells = _split(place)
            if len(cells) == len(columns) and _fits(cells, columns, numbers):
                break
        else:
            place = places[0]
        assert place.record is not None
        return Place(path, place.record - 1), tuple(columns), tuple(columns), _delimiter(place)

    return next(_read(path, header, numbers, None))


def read_records(path: Path, *, spelling: Spelling = tuple, ragged: bool = False) -> ColumnTable:
    """Read a table of texts whose first line names the columns.

    Lines without content are skipped. If `ragged` is True, cells may be missing at the end of a line.
    `spelling` returns the names of all columns from those in the file.
    """
    lines = [line if line.strip(" \t,;|") else "" for line in read_lines(path)]
    head = _head(path, "\n".join(lines), (), spelling, None)
    columns, delimiter = _named(head, _split(head), spelling), _delimiter(head)
    assert head.record is not None
    rows, records = _by_lines(path, lines, head.record, columns, delimiter, (), ragged=ragged)
    cells = {name: [row[k] for row in rows] for k, name in enumerate(columns)}
    return ColumnTable(path, head, columns, len(rows), cells, records, delimiter)


def renaming(aliases: Mapping[str, Collection[str]]) -> Spelling:
    """Return a spelling that renames columns by their first alias, in small letters."""

    def spelling(names: Sequence[str]) -> Sequence[str]:
        found, lowered = list(names), [name.casefold() for name in names]
        for column, others in aliases.items():
            if column not in found and (own := next((each for each in others if each in lowered), None)):
                found[lowered.index(own)] = column
        return found

    return spelling


def cells(place: Place, delimiter: str = ",", *, blanks: bool = False) -> list[str]:
    """Split a record at a delimiter, except inside quotation marks.

    `blanks`: whether blanks may precede quotation marks.
    """
    text = place.text or ""
    if len(text) > LONGEST_RECORD:
        raise place.error(phrase("error.too-long", length=len(text), most=LONGEST_RECORD))
    if delimiter == " ":
        return [whole or bare for whole, bare in _BLANKS.findall(text)]
    if '"' not in text:
        return [cell.strip() for cell in text.split(delimiter)] if text else []
    try:
        row = next(csv.reader([text], delimiter=delimiter, skipinitialspace=blanks))
    except csv.Error as error:
        raise place.error(phrase("error.parse", format="CSV", reason=str(error))) from None
    return [cell.strip() for cell in row]


_Header = tuple[Place, tuple[str, ...], tuple[str, ...], str]


class _IrregularError(Exception):
    """The extension module cannot read a table."""


def _read(
    path: Path, header: Callable[[str], _Header], numbers: Collection[str], size: int | None
) -> Iterator[ColumnTable]:
    if path.suffix.lower() != ".xlsx" and path.is_file() and path.stat().st_size > LARGE:
        begin = read_beginning(path, LARGE).rpartition("\n")[0]
        # If the header is not at the beginning, the whole text is searched.
        with suppress(InputError, _IrregularError):
            found = header(begin)
            if size is not None:
                # No batch may precede an irregular line.
                deque(_regular(path, found, numbers, size), maxlen=0)
            yield from _regular(path, found, numbers, size)
            return
    text = read_text(path)
    head, own, columns, delimiter = header(text)
    assert head.record is not None
    rows, records = _by_lines(path, text.split("\n"), head.record, columns, delimiter, numbers)
    if rows and len(rows[0]) > len(columns):
        own, columns = ("", *own), (NAMELESS, *columns)
    cells = {name: [row[k] for row in rows] for k, name in enumerate(columns) if name}
    numeric = [name for name in cells if name in numbers]
    marks = marks_of((cell for name in numeric for cell in cells[name]), delimiter)
    formats = dict.fromkeys(numeric, marks)
    yield ColumnTable(path, head, columns, len(rows), cells, records, delimiter, formats, own)


def _head(
    path: Path,
    text: str,
    known: Collection[str],
    spelling: Spelling,
    hint: Callable[[Sequence[str]], str | Phrase] | None,
) -> Place:
    """Find the header: the first line, or the last comment before it.

    If title lines precede it, it is the first line below them with several known columns.
    """
    comment: Place | None = None
    for record, match in enumerate(_LINE.finditer(text), 1):
        line = match[1]
        if line.lstrip().startswith(COMMENT):
            comment = Place(path, record, line.lstrip()[1:])
            continue
        if not line.strip(" \t,;|") or _SEPARATOR.fullmatch(line):
            continue
        head = Place(path, record, line)
        for place in (head, comment):
            if place is not None and not set(known).isdisjoint(spelling(_names(place))):
                return place
        if known and comment is None:
            for number, row in enumerate(itertools.islice(_LINE.finditer(text), record, TITLES), record + 1):
                below = Place(path, number, row[1])
                if len(set(known).intersection(spelling(_names(below)))) > 2:
                    return below
            if hint is not None:
                raise head.error(hint([cell.strip() for cell in _split(head)]))
            raise head.error(phrase("cells.header", names=sorted(known)))
        return head
    if comment is not None and not set(known).isdisjoint(spelling(_names(comment))):
        return comment
    raise Place(path).error(phrase("error.empty-file", content="a table"))


def _names(place: Place) -> tuple[str, ...]:
    return tuple(cell.strip().lower() for cell in _split(place))


def _delimiter(head: Place) -> str:
    outside = re.sub(r'"[^"]*"', "", head.text or "")
    default = " " if len(outside.split()) > 1 else ","
    return next((each for each in DELIMITERS if each in outside), default)


def _split(place: Place) -> list[str]:
    return cells(place, _delimiter(place), blanks=True)


def _by_lines(
    path: Path,
    lines: Sequence[str],
    head: int,
    columns: Sequence[str],
    delimiter: str,
    numbers: Collection[str],
    *,
    ragged: bool = False,
) -> tuple[list[list[str]], list[int]]:
    """Split the lines below a header into rows of equal width.

    If rows have one cell more than the header, the first column is unnamed if numbers fit their columns then.
    """

    def is_shifted(cells: Sequence[str]) -> bool:
        all_numbers = numbers and set(columns) <= set(numbers)
        return _fits(cells, columns, numbers, 1) and (all_numbers or not _fits(cells, columns, numbers))

    rows, records = list[list[str]](), list[int]()
    width = len(columns)
    for record in range(head + 1, len(lines) + 1):
        line = lines[record - 1]
        if not line.strip() or line.lstrip().startswith(COMMENT):
            continue
        place = Place(path, record, line)
        row = cells(place, delimiter, blanks=True)
        row += [""] * (width - len(row)) if ragged else []
        if len(row) != width:
            # A delimiter at the end of every line produces an additional empty cell.
            if len(row) == width + 1 and not row[-1]:
                row.pop()
            elif not rows and len(row) == width + 1 and is_shifted(row):
                width += 1
            else:
                raise place.error(phrase("error.cells", count=len(row), columns=width))
        rows.append(row)
        records.append(record)
    return rows, records


def _fits(cells: Sequence[str], columns: Sequence[str], numbers: Collection[str], first: int = 0) -> bool:
    """Return whether the cells from the `first` on are empty or numbers in the columns of numbers."""
    return all(_NUMBER.fullmatch(cells[first + k]) for k, name in enumerate(columns) if name in numbers)


def _regular(
    path: Path, header: _Header, numbers: Collection[str], size: int | None
) -> Iterator[ColumnTable]:
    """Yield a large table in batches; `_IrregularError` if a line is irregular."""
    head, _, columns, delimiter = header
    assert head.record is not None
    if delimiter == " " or not all(columns):
        raise _IrregularError
    first, length, reader = head.record + 1, 0, None
    with reading(path), path.open("rb") as file:
        mark = codecs.BOM_UTF8
        file.seek(len(mark) if file.read(len(mark)) == mark else 0)
        above = b"".join(itertools.islice(file, head.record))
        # A single carriage return ends a line, too.
        if b"\r" in above.replace(b"\r\n", b""):
            raise _IrregularError
        while lines := file.read(PIECE) + file.readline():
            reader = reader or _photocore.TableReader(ord(delimiter), [name in numbers for name in columns])
            # All batches must have the same decimal mark.
            if not reader.add(lines) or (size is not None and delimiter != "," and b"," in lines):
                raise _IrregularError
            length += len(lines)
            # The reader rejects lines below a blank one.
            if size is not None and length >= size and len(lines) - len(lines.rstrip()) < 3:
                yield (table := _of_reader(path, header, reader, first))
                first, length, reader = first + table.count, 0, None
    if reader is not None:
        yield _of_reader(path, header, reader, first)
    elif first == head.record + 1:
        raise _IrregularError


def _of_reader(path: Path, header: _Header, reader: _photocore.TableReader, first: int) -> ColumnTable:
    head, own, columns, delimiter = header
    cells: dict[str, Cells] = {}
    for column, content in zip(columns, reader.columns(), strict=True):
        if isinstance(content, np.ndarray):
            cells[column] = content
            continue
        text, rows, distinct = content
        names = decoded(text).split("\n")[:-1]
        is_plain = text.isascii()
        cells[column] = (
            NameColumn(names, rows, distinct) if is_plain else merged(rows, list(map(str.strip, names)))
        )
    count = len(cells[columns[0]])
    if not count:
        raise _IrregularError
    return ColumnTable(path, head, columns, count, cells, range(first, first + count), delimiter, own=own)


def _parquet(
    path: Path, spelling: Spelling, numbers: Collection[str], size: int | None
) -> Iterator[ColumnTable]:
    """Yield a table of Parquet in batches, at least one."""
    import pyarrow
    from pyarrow import parquet

    first = 1
    try:
        with parquet.ParquetFile(path) as file:
            if size is None or not file.metadata.num_rows:
                yield _of_arrow(path, file.read(), spelling, numbers, first)
                return
            for batch in file.iter_batches(max(size // ROW, 1)):
                yield _of_arrow(path, pyarrow.Table.from_batches([batch]), spelling, numbers, first)
                first += len(batch)
    except (OSError, pyarrow.ArrowException) as error:
        reason = str(error).split("\n")[0]
        raise InputError(phrase("error.parse", format="Parquet", reason=reason), file=path) from None


def _of_arrow(
    path: Path, table: pyarrow.Table, spelling: Spelling, numbers: Collection[str], first: int
) -> ColumnTable:
    from pyarrow import types

    from photogram.io.parquet import coded

    head, own = Place(path), tuple(name.strip().lower() for name in table.column_names)
    columns = _named(head, own, spelling)
    cells: dict[str, Cells] = {}
    for name, column in zip(columns, table.columns, strict=True):
        is_number = types.is_floating(column.type) or types.is_integer(column.type)
        is_text = types.is_string(column.type) or types.is_large_string(column.type)
        # Names may consist of digits.
        digits = types.is_integer(column.type) and name not in numbers
        if is_text or digits or types.is_dictionary(column.type):
            texts, codes = coded(column)
            empty = [""] * bool((codes < 0).any())  # The last name
            cells[name] = merged(codes % (len(texts) + 1), [*(str(text).strip() for text in texts), *empty])
        elif is_number:
            cells[name] = column.to_numpy().astype(float)
        else:
            cells[name] = ["" if each is None else str(each) for each in column.to_pylist()]
    records = range(first, first + table.num_rows)
    return ColumnTable(path, head, columns, table.num_rows, cells, records, own=own)
