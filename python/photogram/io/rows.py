"""Tables with commas, semicolons, tabs or bars, and located errors.

No file can make reading expensive or cause another error than :class:`InputError`. Records have a maximum
length, which limits cells below the limit of the module `csv`. Columns are looked up by name, and numbers
have one strict spelling (:mod:`photogram.io.numbers`).
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from photogram.io.files import read_lines
from photogram.io.places import Place
from photogram.messages import missing_columns
from photogram.words import phrase

DELIMITERS = ("\t", ";", ",", "|")  # Possible delimiters in a header, in order of priority
LONGEST_RECORD = 100_000  # Characters of a record; the module `csv` rejects cells above 131,072


@dataclass(frozen=True, slots=True)
class Row:
    """One record: its cells by column, and its location; invalid cells are rejected."""

    cells: Mapping[str, str]
    place: Place
    commas: bool = False  # Whether decimals may have commas, which then do not separate cells

    def integer(self, column: str, default: int | None = None) -> int:
        """Return an integer that is not negative; `default` if missing."""
        text = self.cells.get(column, "")
        if not text and default is not None:
            return default
        return self.place.whole(text, phrase("cells.cell", column=column))

    def number(self, column: str) -> float | None:
        """Return a finite number; None if the cell is blank or the column is missing."""
        text = self.cells.get(column, "")
        if not text:
            return None
        number = text.replace(",", ".") if self.commas and "." not in text else text
        return self.place.number(number, phrase("cells.cell", column=column))

    def required(self, column: str) -> float:
        """Return a finite number."""
        value = self.number(column)
        if value is None:
            raise self.place.error(phrase("error.column", column=column, message=phrase("error.empty")))
        return value


@dataclass(frozen=True)
class Table:
    """A table: column names, and records, which are split one at a time."""

    path: Path  # The file
    head: Place  # The record with the column names
    columns: tuple[str, ...]  # Their names
    records: tuple[Place, ...]  # The records below, without blank ones and comments
    comments: tuple[Place, ...] = ()  # Comment records
    ragged: bool = False  # Whether cells may be missing at the end of a record; they are blank then
    delimiter: str = ","  # Delimiter of the header

    @classmethod
    def read(
        cls,
        path: Path,
        *,
        comment: str | None = None,
        ragged: bool = False,
        spelling: Callable[[str], str] = str,
    ) -> Table:
        """Read a table whose first record names the columns.

        `comment` is the mark of comments, `spelling` returns the name of a column from its name in the file.
        """
        comments: list[Place] = []
        records: list[Place] = []
        for number, line in enumerate(read_lines(path), 1):
            if comment is not None and line.lstrip().startswith(comment):
                comments.append(Place(path, number, line))
            elif line.strip(" \t,;|"):
                records.append(Place(path, number, line))
        if not records:
            raise Place(path).error(phrase("error.empty-file", content="a table"))
        head, *body = records
        delimiter = next((each for each in DELIMITERS if each in (head.text or "")), ",")
        columns = tuple(spelling(name) for name in cells(head, delimiter))
        if twice := [name for name, count in Counter(columns).items() if name and count > 1]:
            raise head.error(phrase("error.repeated", kind="column", name=twice[0]))
        return cls(path, head, columns, tuple(body), tuple(comments), ragged, delimiter)

    def renamed(self, aliases: Mapping[str, Collection[str]]) -> Table:
        """Return the table with columns renamed by their first alias."""
        names, lowered = list(self.columns), [name.casefold() for name in self.columns]
        for column, others in aliases.items():
            if column not in names and (own := next((each for each in others if each in lowered), None)):
                names[lowered.index(own)] = column
        return replace(self, columns=tuple(names))

    def require(self, *columns: str) -> None:
        """Reject a table without these columns."""
        there = set(self.columns)
        if missing := [column for column in columns if column not in there]:
            raise self.head.error(missing_columns(missing, self.columns))

    def rows(self) -> Iterator[Row]:
        """Split the records one after the other."""
        count = len(self.columns)
        for place in self.records:
            texts = cells(place, self.delimiter)
            if len(texts) > count or (len(texts) < count and not self.ragged):
                raise place.error(phrase("error.cells", count=len(texts), columns=count))
            yield Row(dict(zip(self.columns, texts, strict=False)), place, self.delimiter != ",")


def cells(place: Place, delimiter: str = ",", *, blanks: bool = False) -> list[str]:
    """Split a record at a delimiter, except inside quotation marks.

    `blanks`: whether blanks may precede quotation marks.
    """
    text = place.text or ""
    if len(text) > LONGEST_RECORD:
        raise place.error(phrase("error.too-long", length=len(text), most=LONGEST_RECORD))
    try:
        return [
            cell.strip() for cell in next(csv.reader([text], delimiter=delimiter, skipinitialspace=blanks))
        ]
    except csv.Error as error:
        raise place.error(phrase("error.parse", format="CSV", reason=str(error))) from None


def read_rows(
    path: Path, needed: Collection[str], aliases: Mapping[str, Collection[str]] = MappingProxyType({})
) -> list[Row]:
    """Read a ragged table without comments, with the required columns `needed`.

    `aliases` are headings of other programs, in small letters, for columns that do not have their own names.
    """
    table = Table.read(path, ragged=True).renamed(aliases)
    table.require(*needed)
    return list(table.rows())
