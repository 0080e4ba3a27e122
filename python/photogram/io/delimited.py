"""Tables as people write them: any usual delimiter, decimal point or comma, comments, columns in any order.

The header says what is what. A record is a line; names may stand in quotation marks. Large tables that are
well formed go through the parser of pandas; all others, and all that is at fault, are read line by line with
the same result and the place of every cell.
"""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.column_table import ColumnTable, Names, merged
from photogram.io.files import read_beginning, read_text, reading
from photogram.io.places import Place
from photogram.io.rows import DELIMITERS, LONGEST_RECORD
from photogram.messages import listed, quoted

LARGE = 1 << 20
"""Bytes from which a table is worth the parser of pandas."""
PIECE = 1 << 22
"""Characters of a large table that are parsed at a time."""
COMMENT = "#"
TITLES = 30
"""Lines in which a header is looked for below titles."""
NAMELESS = "?"
"""The first column where each row has a cell more than the header."""
Spelling = Callable[[Sequence[str]], Sequence[str]]
_SEPARATOR = re.compile(r"sep=.", re.IGNORECASE)
"""What Excel writes before a table."""
_WHOLE = re.compile("0|[1-9][0-9]*")
"""A whole number as Python writes it."""
_NUMBER = re.compile(r"[-+]?[\d.,'’ \u00a0\u202f]*(?:[eE][-+]?\d+)?")
_BLANKS = re.compile(r'"([^"]*)"|(\S+)')


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

    def header(text: str) -> _Header:
        head, delimiter = _head(path, text, known, spelling, hint)
        own = _lowered(head, delimiter)
        return head, own, _named(head, own, spelling, settled=hint is not None), delimiter

    return _read(path, header, numbers)


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

    def header(text: str) -> _Header:
        lines = text.split("\n")
        filled = [
            row for row, line in enumerate(lines) if line.strip() and not line.lstrip().startswith(COMMENT)
        ]
        first = next(
            (row for row in filled[:TITLES] if _fits(Place(path, row + 1, lines[row]), columns, numbers)), 0
        )
        first = first or (filled[0] if filled else 0)
        sample = Place(path, first + 1, lines[first])
        return Place(path, first), tuple(columns), tuple(columns), _delimiter(sample)

    return _read(path, header, numbers)


_Header = tuple[Place, tuple[str, ...], tuple[str, ...], str]
"""The record of a header, the columns as the file and as photogram call them, and the delimiter."""


def _read(path: Path, header: Callable[[str], _Header], numbers: Collection[str]) -> ColumnTable:
    """Read a table; one that is large and well formed piece by piece, by its header at the beginning."""
    if path.suffix.lower() != ".xlsx" and path.is_file() and path.stat().st_size > LARGE:
        begin = read_beginning(path, LARGE).rpartition("\n")[0]
        for encoding in ("utf-8-sig", "cp1252"):
            try:
                fast = _by_pandas(path, encoding, header(begin), numbers)
            except UnicodeDecodeError:
                continue
            except InputError:
                # The whole text may have its header later.
                break
            if fast is not None:
                return fast
            break
    text = read_text(path)
    head, own, columns, delimiter = header(text)
    assert head.record is not None
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
    for record, line in enumerate(itertools.islice(_lines(text), TITLES), 1):
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


def _by_pandas(path: Path, encoding: str, header: _Header, numbers: Collection[str]) -> ColumnTable | None:
    """Read a large table; None if anything is not as it should be: `_by_lines` then names the place."""
    head, own, columns, delimiter = header
    assert head.record is not None
    if delimiter == " " or not all(columns):
        return None
    most = _line_ends(path) + 1
    values = {each: np.empty(most) for each in columns if each in numbers}
    names = {each: _NameColumn(most) for each in columns if each not in numbers}
    count = 0
    for piece, frame in _parsed(path, encoding, header, numbers):
        lines = piece.count("\n") + 1
        if "\0" in piece or piece.startswith(COMMENT) or "\n" + COMMENT in piece:
            return None
        rows = slice(count, count + lines)
        if frame is None or len(frame) != lines or rows.stop > most:
            return None
        empty = False
        for each, column in values.items():
            column[rows] = frame[each]
            if np.isinf(column[rows]).any():
                return None
            empty = empty or bool(np.isnan(column[rows]).any())
        if empty and not _empty_cells(piece, delimiter, lines, len(columns)):
            return None
        if not all(each.add(rows, frame[name]) for name, each in names.items()):
            return None
        count += lines
    if not count:
        return None
    for whole in values.values():
        whole.resize(count, refcheck=False)
    ready: dict[str, Floats | Names] = {**values}
    while names:
        name, own_names = names.popitem()
        ready[name] = own_names.names(count)
    records = range(head.record + 1, head.record + 1 + count)
    return ColumnTable(path, head, columns, count, {}, records, delimiter, ready, own=own)


class _NameColumn:
    """A column of names, built from pieces. Whole numbers are compared as numbers, all of them at once."""

    def __init__(self, most: int) -> None:
        self._rows = np.empty(most, dtype=np.int64)
        # The rows before this one have whole numbers, the rows after it places of names.
        self._whole = 0
        # A new name has the next number.
        self._places = defaultdict[str, int](itertools.count().__next__)

    def add(self, rows: slice, cells: Any) -> bool:
        """Append the cells of a piece. Return False if a cell is empty."""
        import pandas as pd

        if cells.dtype == np.int64:
            self._rows[rows] = cells
            self._whole = rows.stop
            return True
        if self._whole:
            before = self.names(self._whole)
            self._rows[: self._whole] = before.rows
            for name in before.names:
                self._places[name]
            self._whole = 0
        codes, texts = pd.factorize(cells)
        if (codes < 0).any():
            return False
        places = map(self._places.__getitem__, map(str.strip, texts.tolist()))
        self._rows[rows] = np.fromiter(places, np.int64, len(texts))[codes]
        return True

    def names(self, count: int) -> Names:
        """Return the names of all rows."""
        import pandas as pd

        if self._whole:
            codes, whole = pd.factorize(self._rows[:count])
            return Names(list(map(str, whole.tolist())), codes, whole=True)
        self._rows.resize(count, refcheck=False)
        return Names(list(self._places), self._rows)


def _line_ends(path: Path) -> int:
    with reading(path), path.open("rb") as file:
        return sum(piece.count(b"\n") for piece in iter(partial(file.read, PIECE), b""))


def _pieces(path: Path, encoding: str, first: int) -> Iterator[str]:
    """Yield the lines of a file behind so many first ones in pieces, without the blank lines at the end."""
    with reading(path), path.open(encoding=encoding) as file:
        for _ in range(first):
            file.readline()
        piece = file.read(PIECE) + file.readline()
        while piece:
            after = file.read(PIECE) + file.readline()
            body = piece.removesuffix("\n") if after else piece.rstrip("\n")
            if body or after:
                yield body
            piece = after


def _parsed(
    path: Path, encoding: str, header: _Header, numbers: Collection[str]
) -> Iterator[tuple[str, Any]]:
    """Yield pieces of a table with their frames, None of other cells; a thread parses the next piece."""
    from concurrent.futures import ThreadPoolExecutor

    head, _, columns, delimiter = header
    assert head.record is not None
    pieces = _pieces(path, encoding, head.record)
    piece = next(pieces, "")
    parse = _parser(path, piece, columns, delimiter, numbers)
    with ThreadPoolExecutor(1) as pool:
        frame = pool.submit(parse, piece)
        for after in pieces:
            ahead = pool.submit(parse, after)
            yield piece, frame.result()
            piece, frame = after, ahead
        if piece:
            yield piece, frame.result()


def _parser(
    path: Path, piece: str, columns: Sequence[str], delimiter: str, numbers: Collection[str]
) -> Callable[[str], Any]:
    """Return what makes a frame of a piece of a table, and None of one with other cells."""
    import pandas as pd

    # From version 3 on pandas reads every number to the last bit, and does not want to be asked.
    exact: dict[str, Any] = (
        {} if int(pd.__version__.partition(".")[0]) >= 3 else {"float_precision": "round_trip"}
    )
    sample = _split(Place(path, text=piece.partition("\n")[0]), delimiter)
    comma = delimiter != "," and any(
        "," in cell for each, cell in zip(columns, sample, strict=False) if each in numbers
    )
    form: dict[str, Any] = {
        "sep": delimiter,
        "names": list(columns),
        "header": None,
        "index_col": False,
        "decimal": "," if comma else ".",
        "keep_default_na": False,
        "na_values": [""],
        "skipinitialspace": True,
        "skip_blank_lines": False,
        "low_memory": False,
        "engine": "c",
        **exact,
    }

    kinds = {
        each: "float64" if each in numbers else "int64" if _WHOLE.fullmatch(cell) else "object"
        for each, cell in itertools.zip_longest(columns, sample[: len(columns)], fillvalue="")
    }

    def frame_of(cells: bytes) -> Any:
        try:
            return pd.read_csv(io.BytesIO(cells), dtype=kinds, **form)
        except (ValueError, OverflowError, pd.errors.ParserError, pd.errors.ParserWarning):
            return None

    def parsed(text: str) -> Any:
        cells = text.encode()
        frame = frame_of(cells)
        whole = [each for each, kind in kinds.items() if kind == "int64"]
        if whole and (frame is None or not _as_written(frame, whole, cells, delimiter)):
            kinds.update(dict.fromkeys(whole, "object"))
            frame = frame_of(cells)
        return frame

    return parsed


def _as_written(frame: Any, columns: Sequence[str], cells: bytes, delimiter: str) -> bool:
    """Whether whole numbers of a frame are all that their cells have: digits alone, without a leading 0."""
    signs = np.frombuffer(cells, dtype=np.uint8)
    bounds = np.flatnonzero((signs == ord(delimiter)) | (signs == ord("\n")))
    shape = frame.shape
    if b'"' in cells or len(bounds) + 1 != frame.size:
        return False
    starts = np.append(0, bounds + 1).reshape(shape)
    if (signs[starts[1:, 0] - 1] != ord("\n")).any():
        return False
    zero = ord("0")
    for each in columns:
        first = starts[:, frame.columns.get_loc(each)]
        # A blank and a sign come before 0.
        if frame[each].dtype != np.int64 or (signs[first] < zero).any():
            return False
        leading = first[signs[first] == zero] + 1
        following = signs[leading[leading < len(signs)]]
        if ((following >= zero) & (following <= ord("9"))).any():
            return False
    return True


def _empty_cells(body: str, delimiter: str, count: int, width: int) -> bool:
    """Whether all that pandas has no number of must be empty cells: no row is short, and none says NaN."""
    whole = '"' not in body and body.count(delimiter) == count * (width - 1)
    return whole and "nan" not in body.casefold()


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
            ready[name] = merged(codes, texts)
        elif pyarrow.types.is_floating(kind) or pyarrow.types.is_integer(kind):
            ready[name] = column.to_numpy().astype(float)
        else:
            cells[name] = ["" if each is None else str(each) for each in column.to_pylist()]
    records = range(1, table.num_rows + 1)
    return ColumnTable(path, head, columns, table.num_rows, cells, records, ready=ready, own=own)
