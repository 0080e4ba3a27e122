"""TOML files: values with type and range, and located errors."""

from __future__ import annotations

import json
import re
import sys
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import date
from pathlib import Path
from typing import Any, ClassVar, Self

from photogram.arguments.arrays import value_field
from photogram.errors import InputError
from photogram.io.files import read_bytes, utf8_text
from photogram.io.places import Place
from photogram.io.tree import Tree
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import unknown_name
from photogram.words import Phrase, phrase

MOST_DIGITS = 1000
# Python reports no line for such integers, and cannot print them.
_ENDLESS = re.compile(rf"\d(?:[\d_]{{{MOST_DIGITS}}}|x[\da-fA-F_]{{{MOST_DIGITS}}})")


class TomlFile:
    """The content of a file.

    `replaced` are values that replace values of the file: `section.key=value`, texts with or without quotes.
    """

    def __init__(self, path: Path, replaced: Sequence[str] = ()) -> None:
        self.path = path
        text = utf8_text(read_bytes(path), path).replace("\r\n", "\n")
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
            raise self._place(int(where[1]) if where else len(self.lines)).error(message) from None
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
        own: Any = value.strip()
        # A value without the syntax of TOML is a text, and so are several lines.
        with suppress(ValueError):
            (own,) = (own,) if _ENDLESS.search(own) else tomllib.loads(f"value = {own}").values()
        self.content = {**self.content, section: {**table, key: own}}
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
        for lines, pattern in ((own, first), (own, rf"^[^#]*[\[{{,.\s]{word}")) if key else ():
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


@dataclass(frozen=True)
class TomlTree(Tree):
    """A value of a TOML file: `path` is its table; errors contain the line of the key."""

    _LARGEST: ClassVar[float] = sys.float_info.max

    key: str = ""
    source: TomlFile = field(kw_only=True)

    @property
    def name(self) -> str:
        """Name of the value as a table."""
        return f"{self.path}.{self.key}" if self.path and self.key else self.key

    def _member(self, key: str, value: Any) -> Self:
        return replace(self, value=value, path=self.name, key=key)

    def _element(self, number: int, value: Any) -> Self:
        key = f"{self.key} {number + 1}" if isinstance(value, dict) else self.key
        return replace(self, value=value, key=key)

    def error(self, message: str | Phrase) -> InputError:
        """Return an error that names file, line, table and key, also of a member that the message names."""
        if isinstance(message, Phrase) and message.code == "error.at":
            member, inner = message.fields["what"], message.fields["message"]
            if member == self.key or (isinstance(self.value, dict) and member in self.value):
                return (self if member == self.key else self[member]).error(inner)
        if self.path:
            message = phrase("error.key", table=self.path, key=self.key, message=message)
        elif self.key:
            what = f"[{self.key}]" if isinstance(self.value, dict) else self.key
            message = phrase("error.at", what=what, message=message)
        return self.source.error(self.key, message, self.path)

    def _missing(self, key: str) -> InputError:
        if not self.name:
            return InputError(phrase("error.missing", name=f"[{key}]"), file=self.file)
        return self.source.error(key, phrase("toml.missing", table=self.name, key=key), self.name)

    def only(self, keys: Collection[str]) -> None:
        """Reject other keys."""
        for key in self.value:
            if key not in keys:
                message = unknown_name("key", key, keys)
                if self.name:
                    message = phrase("error.at", what=f"[{self.name}]", message=message)
                raise self.source.error(key, message, self.name)

    def day(self) -> date:
        """Return a date."""
        try:
            return day_of(self.value)
        except ValueError:
            raise self.value_error("error.day") from None

    def says(self, today: str, report: str) -> bool:
        """Return whether the key in present units is set; reject both keys."""
        if today in self and report in self:
            raise self[today].error(phrase("error.exclusive", first=today, second=report))
        return today in self

    def changed(self, values: Mapping[str, Mapping[str, Any]]) -> Self:
        """Return the document with new values of keys, by table."""
        tables = {name: {**self.table(name).value, **others} for name, others in values.items() if others}
        return replace(self, value={**self.value, **tables})


def read_toml(path: Path) -> TomlTree:
    source = TomlFile(path)
    return TomlTree(source.content, path, source=source)


def read_document(
    path: Path,
    keys: Mapping[str, Collection[str] | None],
    replaced: Sequence[str] = (),
    several: str = "",
) -> TomlTree:
    """Read a TOML file with the allowed keys of each table (None: any).

    Only the table `several` may be repeated; it is a list.
    """
    source = TomlFile(path, replaced)
    tables: dict[str, Any] = {}
    for name, content in source.content.items():
        if name not in keys:
            raise source.error(name, unknown_name("table", name, keys))
        rows = content if isinstance(content, list) else [content]
        if not all(isinstance(row, dict) for row in rows):
            raise TomlTree(content, path, "", name, source=source).value_error("error.table")
        if name != several and len(rows) != 1:
            raise source.error(name, phrase("error.repeated", kind="table", name=name))
        tables[name] = rows if name == several else rows[0]
        document = TomlTree({name: tables[name]}, path, source=source)
        if (known := keys[name]) is not None:
            for table in document[name] if name == several else [document[name]]:
                table.only(known)
    return TomlTree(tables, path, source=source)
