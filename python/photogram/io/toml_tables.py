"""Tables of TOML files: values are read by kind and range, and errors name file, table and key."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from photogram.errors import InputError
from photogram.io.toml import TomlFile, float_of
from photogram.messages import listed
from photogram.words import Phrase, phrase

_LONGEST = 60  # Characters of a value that an error shows


class Table:
    """One table of a TOML file, by its name in errors.

    Missing values without a default, values of another kind or beyond their limits are an :class:`InputError`
    that names file, table and key.
    """

    def __init__(self, values: Mapping[str, Any], name: str, file: Path) -> None:
        self.values, self.name, self.file = dict(values), name, file

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def error(self, key: str, text: str | Phrase) -> InputError:
        """Return an error that names file, table and key."""
        return InputError(phrase("error.key", table=self.name, key=key, message=text), file=self.file)

    def table(self, key: str) -> Table:
        """Return a table within this one; an empty one where it is missing."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise self.error(key, f"is {_shown(value)}, not a table")
        return Table(value, f"{self.name}.{key}", self.file)

    def only(self, known: Collection[str]) -> None:
        """Refuse keys that are not known."""
        unknown = sorted(set(self.values) - set(known))
        if unknown:
            raise InputError(f"[{self.name}] has no {listed(unknown)}", file=self.file)

    def number(
        self, key: str, default: float | None = None, *, low: float = -math.inf, high: float = math.inf
    ) -> float:
        """Return a finite number between two limits."""
        value = self._value(key, default)
        found = self._number(key, value)
        if not low <= found <= high:
            raise self.error(key, f"is {found:g}; it must be {_range(low, high)}")
        return found

    def says(self, today: str, report: str) -> bool:
        """Return whether the table has a value in the units of today; else it may have it in the report's."""
        if today in self and report in self:
            raise self.error(today, f"says what {report} says: one of them is enough")
        return today in self

    def positive(self, key: str, default: float | None = None) -> float:
        """Return a finite number above zero."""
        found = self.number(key, default)
        if not found > 0:
            raise self.error(key, f"is {found:g}; it must be positive")
        return found

    def count(self, key: str, default: int | None = None) -> int:
        """Return a whole number that is not negative."""
        value = self._value(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or abs(value) >= 2**31:
            raise self.error(key, f"is {_shown(value)}, not a whole number")
        if value < 0:
            raise self.error(key, f"is {value}; it cannot be negative")
        return value

    def switch(self, key: str, default: bool | None = None) -> bool:
        """Return true or false."""
        value = self._value(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"is {_shown(value)}, neither true nor false")
        return value

    def text(self, key: str, default: str | None = None) -> str:
        """Return a string."""
        value = self._value(key, default)
        if not isinstance(value, str):
            raise self.error(key, f"is {_shown(value)}, not text: put it in quotation marks")
        return value

    def word(self, key: str, default: str | None = None) -> str:
        """Return a name or a number of something, which may be written as a whole number."""
        return self._word(key, self._value(key, default))

    def words(self, key: str, default: tuple[str, ...] | None = None) -> tuple[str, ...]:
        """Return names of things as `word` does."""
        return tuple(self._word(key, value) for value in self.items(key, default))

    def path(self, key: str) -> Path:
        """Return the path of another file, relative to this one."""
        name = self.text(key)
        if not name or not name.isprintable():
            raise self.error(key, f"is {_shown(name)}, not the name of a file")
        return self.file.parent / name

    def numbers(self, key: str, count: int, default: list[float] | None = None) -> list[float]:
        """Return so many finite numbers; infinite ones where they say that something is held."""
        values = self.items(key, default)
        if len(values) != count:
            raise self.error(key, f"has {len(values)} values, not {count}")
        return [
            math.inf if isinstance(value, float) and value == math.inf else self._number(key, value)
            for value in values
        ]

    def items(self, key: str, default: Collection[Any] | None = None) -> list[Any]:
        """Return a list of anything."""
        value = self._value(key, default)
        if not isinstance(value, list | tuple):
            raise self.error(key, f"is {_shown(value)}, not a list")
        return list(value)

    def rows(self, key: str, kinds: tuple[type[str] | type[float], ...]) -> list[list[Any]]:
        """Return a list of lists of names (`str`) and numbers (`float`); empty where it is missing."""
        found = []
        for row in self.items(key, []):
            if not isinstance(row, list) or len(row) != len(kinds):
                raise self.error(key, f"has {_shown(row)}, not a list of {len(kinds)}")
            found.append(
                [
                    self._word(key, value) if kind is str else self._number(key, value)
                    for kind, value in zip(kinds, row, strict=True)
                ]
            )
        return found

    def _value(self, key: str, default: Any) -> Any:
        value = self.values.get(key, default)
        if value is None:
            raise self.error(key, "is missing")
        return value

    def _number(self, key: str, value: Any) -> float:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        found = float_of(value) if is_number else math.nan
        if not math.isfinite(found):
            raise self.error(key, f"is {_shown(value)}, not a number")
        return found

    def _word(self, key: str, value: Any) -> str:
        if isinstance(value, bool) or not isinstance(value, str | int):
            raise self.error(key, f"has {_shown(value)}, which is neither text nor a whole number")
        return str(value)


class KeyPlace:
    """A table of a file, or a key of it, as the place of errors."""

    def __init__(self, table: Table, key: str = "") -> None:
        self.table, self.key = table, key

    def error(self, message: str | Phrase, /) -> InputError:
        """Return an error that names file, table and key."""
        if self.key:
            return self.table.error(self.key, message)
        located = phrase("error.at", what=f"[{self.table.name}]", message=message)
        return InputError(located, file=self.table.file)


class Document:
    """A TOML file of tables by name, one or several of each; a missing or surplus one is an InputError."""

    def __init__(self, tables: Mapping[str, list[Table]], file: Path) -> None:
        self._tables, self.file = tables, file

    def __contains__(self, name: str) -> bool:
        return name in self._tables

    def table(self, name: str) -> Table:
        """Return a table that must be there, once."""
        if name not in self._tables:
            raise InputError(f"the table {name} is missing", file=self.file)
        if len(self._tables[name]) != 1:
            raise InputError(f"[{name}] is there {len(self._tables[name])} times", file=self.file)
        return self._tables[name][0]

    def optional(self, name: str) -> Table:
        """Return a table, an empty one where it is not there."""
        return self.table(name) if name in self._tables else Table({}, name, self.file)

    def changed(self, values: Mapping[str, Mapping[str, Any]]) -> Document:
        """Return the document with other values of keys, by table."""
        tables = dict(self._tables)
        for name, others in values.items():
            if others:
                tables[name] = [Table({**self.optional(name).values, **others}, name, self.file)]
        return Document(tables, self.file)

    def tables(self, name: str) -> list[Table]:
        """Return all tables of a name."""
        if name not in self._tables:
            raise InputError(f"the table {name} is missing", file=self.file)
        return self._tables[name]


def read_document(path: Path, tables: Mapping[str, Collection[str] | None]) -> Document:
    """Read a TOML file with the keys of each table; None: the reader of the table checks its keys."""
    document = TomlFile(path).content
    unknown = sorted(set(document) - set(tables))
    if unknown:
        raise InputError(f"there is no table {listed(unknown)}", file=path)
    found = {}
    for name, content in document.items():
        single = isinstance(content, dict)
        rows = [content] if single else content
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            raise InputError(f"{name} is not a table", file=path)
        found[name] = [
            Table(row, name if single else f"{name} {number}", path) for number, row in enumerate(rows, 1)
        ]
        for table in found[name]:
            keys = tables[name]
            if keys is not None:
                table.only(keys)
    return Document(found, path)


def _range(low: float, high: float) -> str:
    if math.isinf(low) or math.isinf(high):
        return f"at least {low:g}" if math.isinf(high) else f"at most {high:g}"
    return f"between {low:g} and {high:g}"


def _shown(value: Any) -> str:
    """Write a value as it may stand in an error: not the thousand digits of a number."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**_LONGEST:
        return "a whole number of very many digits"
    if isinstance(value, bool):
        return str(value).lower()
    text = repr(value) if isinstance(value, str | int | float) else str(value)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "..."
