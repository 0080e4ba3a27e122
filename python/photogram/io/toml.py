"""TOML files: values with type and range, and located errors."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

from photogram.arguments.arrays import value_field
from photogram.errors import InputError
from photogram.io.files import read_bytes
from photogram.io.places import Place
from photogram.messages import unknown_name
from photogram.words import Phrase, phrase

MOST_DIGITS = 1000
_ENDLESS = re.compile(rf"\d[\d_]{{{MOST_DIGITS}}}")  # Python reports no line for such integers


class TomlFile:
    """The content of a file.

    `replaced` are values that replace values of the file: `section.key=value`, texts with or without quotes.
    """

    def __init__(self, path: Path, replaced: Sequence[str] = ()) -> None:
        self.path = path
        try:
            text = read_bytes(path).decode("utf-8-sig").replace("\r\n", "\n")
        except UnicodeDecodeError as error:
            raise InputError(phrase("error.encoding", byte=error.start), file=path) from None
        self.lines = text.split("\n")
        if (endless := _ENDLESS.search(text)) is not None:
            record = text.count("\n", 0, endless.start()) + 1
            key = self.lines[record - 1].split("=")[0].strip()
            raise InputError(phrase("toml.digits", key=key, most=MOST_DIGITS), file=path, record=record)
        try:
            self.content: Mapping[str, Any] = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            where = re.search(r"at line (\d+)", str(error))
            message = phrase("error.parse", format="TOML", reason=str(error))
            raise self._place(int(where[1]) if where else None).error(message) from None
        except RecursionError:
            raise InputError(phrase("error.nested"), file=path) from None
        self._replaced: dict[tuple[str, str], str] = {}
        for text in replaced:
            self._replace(text)

    def _replace(self, text: str) -> None:
        name, equals, value = text.partition("=")
        section, point, key = name.strip().partition(".")
        if not (equals and point and section and key):
            raise InputError(phrase("toml.replace", text=text))
        table = self.content.get(section, {})
        if not isinstance(table, dict):
            raise self.error(section, phrase("error.table", value=value_field(table)))
        self.content = {**self.content, section: {**table, key: _value(value.strip())}}
        self._replaced[section, key] = text

    def _place(self, record: int | None) -> Place:
        known = record is not None and record <= len(self.lines)
        return Place(self.path, record, self.lines[record - 1] if record and known else None)

    def error(self, key: str, message: str | Phrase, section: str = "") -> InputError:
        """Return an error at the line of a key or table, if in the section."""
        replaced = [text for pair, text in self._replaced.items() if pair == (section, key) or pair[0] == key]
        if replaced:
            return InputError(
                phrase("error.at", what=f"--set {replaced[0]}", message=message), file=self.path
            )
        return self.place(key, section).error(message)

    def place(self, key: str, section: str = "") -> Place:
        """Return the first line with a key or table, preferably in the section."""
        word = rf"[\"']?{re.escape(key)}[\"']?\s*[\]=.]"
        own = list(self._lines_of(section)) if section else []
        first = rf"^\s*\[?\[?\s*{word}"
        # Inline tables and names with points have their keys inside a line.
        for lines, pattern in ((own, first), (own, rf"^[^#]*[\[{{,.\s]{word}")):
            for record, line in lines or enumerate(self.lines, 1):
                if re.match(pattern, line):
                    return self._place(record)
        return self._place(own[0][0] if own else None)

    def _lines_of(self, section: str) -> Iterator[tuple[int, str]]:
        """Yield the numbered lines of a section.

        The section `NAME 2` is the second table of an array.
        """
        name, blank, number = section.rpartition(" ")
        several = bool(blank) and number.isdigit()
        word = rf"\s*[\"']?{re.escape(name if several else section)}[\"']?\s*"
        below, inside, count = False, False, 0
        for record, line in enumerate(self.lines, 1):
            if line.lstrip().startswith("["):
                below, inside = True, re.match(rf"\s*\[+{word}[\].]", line) is not None
                count += inside
                inside &= not several or count == int(number)
            if inside or (not below and re.match(rf"{word}[=.]", line)):
                yield record, line


def day_of(value: object) -> date:
    """Return a date of TOML or text (1983-07-02); else `ValueError`."""
    # A datetime of Python is a date, too.
    return value if type(value) is date else date.fromisoformat(value if isinstance(value, str) else "")


def quoted_text(text: str) -> str:
    """Return a text in quotation marks, as in TOML."""
    # Strings of JSON are strings of TOML, except for one control character, which JSON does not escape.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml_text(tables: Mapping[str, Mapping[str, Any]]) -> str:
    """Return tables as TOML text, without empty tables and values (None)."""
    lines = []
    for name, values in tables.items():
        if own := [f"{key} = {_text(value)}" for key, value in values.items() if value is not None]:
            lines += [f"[{name}]", *own, ""]
    return "\n".join(lines)


def with_comments(text: str, former: str) -> str:
    """Return TOML text with the comments and the order of a former text (extra `toml`)."""
    if "#" not in former:
        return text
    try:
        import tomlkit
    except ImportError:
        return text
    new, document = tomlkit.parse(text), tomlkit.parse(former)
    for name in [name for name in document if name not in new]:
        document.remove(name)
    for name, table in new.items():
        old: Any = document.setdefault(name, table)
        for key in [key for key in old if key not in table]:
            old.remove(key)
        old.update({key: value for key, value in table.items() if old.get(key) != value})
    found = tomlkit.dumps(document)
    return found if tomllib.loads(found) == tomllib.loads(text) else text


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return quoted_text(value)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{quoted_text(name)} = {_text(own)}' for name, own in value.items())} }}"
    if isinstance(value, int):
        return str(value)
    return repr(float(value)) if isinstance(value, float) else f"[{', '.join(map(_text, value))}]"


class Table:
    """One table of a TOML file, with its name for errors.

    Missing values without a default, and values of another type or outside their limits are an
    :class:`InputError` that contains file, line, table and key.
    """

    def __init__(self, values: Mapping[str, Any], name: str, source: TomlFile) -> None:
        self.values, self.name, self.source = dict(values), name, source

    @property
    def file(self) -> Path:
        """The file."""
        return self.source.path

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def error(self, key: str, message: str | Phrase) -> InputError:
        """Return an error that names file, line, table and key."""
        return self.source.error(
            key, phrase("error.key", table=self.name, key=key, message=message), self.name
        )

    def value_error(self, key: str, code: str, value: object = None, **fields: Any) -> InputError:
        """Return an error of a value from the code of its message."""
        shown = value_field(self.values.get(key) if value is None else value)
        return self.error(key, phrase(code, value=shown, **fields))

    def table(self, key: str) -> Table:
        """Return a table within this one; an empty one if it is missing."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise self.value_error(key, "error.table")
        return Table(value, f"{self.name}.{key}", self.source)

    def only(self, keys: Collection[str]) -> None:
        """Reject other keys."""
        for key in self.values:
            if key not in keys:
                message = phrase("error.at", what=f"[{self.name}]", message=unknown_name("key", key, keys))
                raise self.source.error(key, message, self.name)

    def number(
        self, key: str, default: float | None = None, *, low: float = -math.inf, high: float = math.inf
    ) -> float:
        """Return a finite number between two limits."""
        number = self._number(key, self.value(key, default))
        if not low <= number <= high:
            code = "error.range" if math.isfinite(low) and math.isfinite(high) else "error.least"
            code = "error.most" if math.isinf(low) else code
            raise self.value_error(key, code, number, low=low, high=high)
        return number

    def says(self, today: str, report: str) -> bool:
        """Return whether the key in present units is set; reject both keys."""
        if today in self and report in self:
            raise self.error(today, phrase("error.exclusive", first=today, second=report))
        return today in self

    def positive(self, key: str, default: float | None = None) -> float:
        """Return a finite positive number."""
        number = self.number(key, default)
        if not number > 0:
            raise self.value_error(key, "error.positive", number)
        return number

    def count(self, key: str, default: int | None = None, *, low: int = 0) -> int:
        """Return an integer with a lower limit."""
        value = self.value(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value < 2**31:
            raise self.value_error(key, "error.whole-range", value, low=low, high=2**31 - 1)
        return value

    def switch(self, key: str, default: bool | None = None) -> bool:
        """Return true or false."""
        return bool(self._of_kind(key, bool, "error.flag", default))

    def text(self, key: str, default: str | None = None) -> str:
        """Return a string."""
        return str(self._of_kind(key, str, "toml.text", default))

    def choice(self, key: str, words: Collection[str], default: str | None = None) -> str:
        """Return one of some words."""
        value = self.value(key, default)
        if not isinstance(value, str) or value not in words:
            raise self.value_error(key, "error.choice", value, names=list(words))
        return value

    def word(self, key: str, default: str | None = None) -> str:
        """Return a name or a number of something, which may be written as an integer."""
        return self._word(key, self.value(key, default))

    def words(self, key: str, default: tuple[str, ...] | None = None) -> tuple[str, ...]:
        """Return names as `word` does."""
        return tuple(self._word(key, value) for value in self.items(key, default))

    def texts(self, key: str) -> tuple[str, ...]:
        """Return a list of strings."""
        values = self.items(key)
        if not all(isinstance(value, str) for value in values):
            raise self.value_error(key, "toml.texts")
        return tuple(values)

    def path(self, key: str) -> Path:
        """Return the path of another file, relative to this one."""
        name = self.text(key)
        if not name or not name.isprintable():
            raise self.value_error(key, "toml.file")
        return self.file.parent / name

    def numbers(
        self, key: str, counts: int | Collection[int], default: Sequence[float] | None = None
    ) -> list[float]:
        """Return finite numbers of an allowed count; infinite: fixed or free.

        A single number needs no brackets.
        """
        values = self.value(key, default)
        allowed = [counts] if isinstance(counts, int) else list(counts)
        values = [values] if 1 in allowed and isinstance(values, int | float) else self.items(key, default)
        if len(values) not in allowed:
            count = Phrase("toml.or", {"counts": allowed})
            raise self.error(key, phrase("error.count", count=count, actual=len(values)))
        return [
            math.inf if isinstance(value, float) and value == math.inf else self._number(key, value)
            for value in values
        ]

    def items(self, key: str, default: Collection[Any] | None = None) -> list[Any]:
        """Return a list of anything."""
        return list(self._of_kind(key, list | tuple, "error.list", default))

    def rows(self, key: str, kinds: tuple[type[str] | type[float], ...]) -> list[list[Any]]:
        """Return a list of lists of names (`str`) and numbers (`float`)."""
        rows = []
        for row in self.items(key, []):
            if not isinstance(row, list) or len(row) != len(kinds):
                raise self.value_error(key, "toml.row", row, count=len(kinds))
            rows.append(
                [
                    self._word(key, value) if kind is str else self._number(key, value)
                    for kind, value in zip(kinds, row, strict=True)
                ]
            )
        return rows

    def value(self, key: str, default: Any = None) -> Any:
        """Return a value of any kind."""
        value = self.values.get(key, default)
        if value is None:
            raise self.source.error(key, phrase("toml.missing", table=self.name, key=key), self.name)
        return value

    def _of_kind(self, key: str, kind: Any, code: str, default: Any) -> Any:
        value = self.value(key, default)
        if not isinstance(value, kind):
            raise self.value_error(key, code, value)
        return value

    def _number(self, key: str, value: Any) -> float:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        number = float_of(value) if is_number else math.nan
        if not math.isfinite(number):
            raise self.value_error(key, "error.number", value)
        return number

    def _word(self, key: str, value: Any) -> str:
        if isinstance(value, bool) or not isinstance(value, str | int):
            raise self.value_error(key, "error.name", value)
        return str(value)


class KeyPlace:
    """Location of a table of a file, or of a key in it."""

    def __init__(self, table: Table, key: str = "") -> None:
        self.table, self.key = table, key

    def error(self, message: str | Phrase, /) -> InputError:
        """Return an error that names file, table and key."""
        if self.key:
            return self.table.error(self.key, message)
        located = phrase("error.at", what=f"[{self.table.name}]", message=message)
        return InputError(located, file=self.table.file)


class Document:
    """A TOML file of named tables; missing or surplus ones are errors."""

    def __init__(self, tables: Mapping[str, list[Table]], source: TomlFile) -> None:
        self._tables, self.source = tables, source

    def __contains__(self, name: str) -> bool:
        return name in self._tables

    def table(self, name: str) -> Table:
        """Return a required table, which must not be repeated."""
        tables = self.tables(name)
        if len(tables) != 1:
            raise self.source.error(name, phrase("error.repeated", kind="table", name=name))
        return tables[0]

    def optional(self, name: str) -> Table:
        """Return a table, an empty one if it is missing."""
        return self.table(name) if name in self._tables else Table({}, name, self.source)

    def changed(self, values: Mapping[str, Mapping[str, Any]]) -> Document:
        """Return the document with new values of keys, by table."""
        tables = dict(self._tables)
        for name, others in values.items():
            if others:
                tables[name] = [Table({**self.optional(name).values, **others}, name, self.source)]
        return Document(tables, self.source)

    def tables(self, name: str) -> list[Table]:
        """Return all tables of a name."""
        if name not in self._tables:
            raise InputError(phrase("error.missing", name=f"[{name}]"), file=self.source.path)
        return self._tables[name]


def read_document(
    path: Path, keys: Mapping[str, Collection[str] | None], replaced: Sequence[str] = ()
) -> Document:
    """Read a TOML file with the allowed keys of each table (None: any)."""
    source = TomlFile(path, replaced)
    tables: dict[str, list[Table]] = {}
    for name, content in source.content.items():
        if name not in keys:
            raise source.error(name, unknown_name("table", name, keys))
        single = isinstance(content, dict)
        rows = [content] if single else content
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            raise source.error(
                name, phrase("error.at", what=name, message=phrase("error.table", value=value_field(content)))
            )
        tables[name] = [
            Table(row, name if single else f"{name} {number}", source) for number, row in enumerate(rows, 1)
        ]
        for table in tables[name]:
            if (known := keys[name]) is not None:
                table.only(known)
    return Document(tables, source)


def _value(text: str) -> Any:
    """Return a value in TOML syntax, or the text itself."""
    try:
        (value,) = tomllib.loads(f"value = {text}").values()
    except ValueError:  # TOMLDecodeError, endless numbers, and a line with several values
        return text
    return value


def float_of(value: float) -> float:
    """Return a number as a float; infinite if an integer exceeds double precision."""
    if isinstance(value, int) and abs(value) >= 2**1023:
        return math.inf if value > 0 else -math.inf
    return float(value)
