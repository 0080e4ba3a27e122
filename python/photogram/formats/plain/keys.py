"""Keys of `project.toml`, as declared in `keys.csv`.

Each row of this file declares a key: its section, `kind`, allowed words (the first is the default), the
`field` of the settings, and an example and the content for docs/formats/plain.md.
"""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Callable, Iterator, Mapping
from datetime import date, datetime
from pathlib import Path
from typing import Any, NamedTuple

from photogram.arguments.arrays import value_field
from photogram.errors import InputError, message_of
from photogram.io.places import at_place
from photogram.io.toml import Document, KeyPlace, Table, TomlFile, day_of, quoted_text
from photogram.words import phrase

SENTENCES = "sentences.toml"  # File for sentences
_CLASS = "class_"
_NUMBERS: Mapping[str, tuple[int, Callable[..., bool], str]] = {
    "place": (3, lambda lat, lon, h: abs(lat) <= 90 and abs(lon) <= 360 and math.isfinite(h), "plain.origin"),
    "axes": (2, lambda a, b: 0 < b <= a < math.inf, "plain.ellipsoid"),
    "limit": (3, lambda a, k, _: math.isfinite(a) and math.isfinite(k), "plain.length-limit"),
}
"""Number of values, their condition and the code of the error of several kinds."""
_SOME_LENGTH = {"line": "1", "from": "A", "to": "B", "length": 1.0, "sd": 0.0}


class Key(NamedTuple):
    """A key of `project.toml`."""

    section: str
    name: str
    kind: str
    words: str
    field: str  # Field of the settings, of their frame, options or photo files, or of a statement
    example: str
    content: str

    def described(self) -> str:
        """Return the line of the reference."""
        words = self.words.split()
        example = self.example or f'"{words[0]}"'
        comment = "; ".join(filter(None, [" | ".join(words), self.content]))
        return f"{f'{self.name} = {example}':<31} # {comment}" if comment else f"{self.name} = {example}"

    def value(self, table: Table, unit: str) -> Any:
        """Return the value in a table; lengths without a unit are in `unit`."""
        name, value = self.name, table.values[self.name]
        match self.kind:
            case "word":
                return table.choice(name, self.words.split())
            case "number" | "positive" | "switch" | "texts":
                return getattr(table, self.kind)(name)
            case "count":
                return table.count(name, low=1)
            case "sd":
                return tuple(table.numbers(name, (1, 3)))
            case "place" | "axes" | "limit":
                count, valid, code = _NUMBERS[self.kind]
                numbers = tuple(table.numbers(name, count))
                if not valid(*numbers):
                    raise table.value_error(name, code)
                return numbers
            case "moment":
                return _moment(table, name, value)
            case "day":
                try:
                    return day_of(value)
                except ValueError:
                    raise table.value_error(name, "error.day") from None
            case "date" if type(value) is date:
                return value.isoformat()
            case "length" | "area":
                from photogram.results.statement.request import length_of

                length = value if isinstance(value, str) else str(value_field(value))
                return length_of(length, unit, area=self.kind == "area")
            case "reasons":
                reasons = table.table(name)
                for point in reasons.values:
                    if not reasons.text(point).strip():
                        raise reasons.error(point, phrase("plain.reason"))
                return value
            case "folder":
                return _existing(table, name, value, "folder") if table.text(name) else None
            case "files":
                names = [value] if isinstance(value, str) else table.texts(name) if value else []
                return tuple(_existing(table, name, each) for each in dict.fromkeys(names))
            case "sentences":
                return read_sentences(_existing(table, name, table.text(name)))
        return table.text(name)

    def written(self, value: Any, unit: str) -> Any:
        """Return a value in the form for :meth:`value`."""
        if value is None or self.kind not in ("length", "area", "sentences"):
            return value
        ending = {"length": unit, "area": f"{unit}2"}
        return SENTENCES if self.kind == "sentences" else f"{float(value)!r}{ending[self.kind]}"


def _moment(table: Table, name: str, value: Any) -> float | str:
    """Return a number of seconds, or a date as text."""
    if isinstance(value, int | float):
        return table.number(name)
    try:
        # TOML has a date type.
        return value.isoformat() if isinstance(value, date) else datetime.fromisoformat(value).isoformat()
    except (TypeError, ValueError):
        raise table.value_error(name, "plain.time-origin") from None


def _existing(table: Table, key: str, name: str, kind: str = "file") -> Path:
    """Return the path of an existing file or folder."""
    path = table.file.parent / name
    # The functions of os.path also accept names that are too long for the system.
    if not (os.path.isdir if kind == "folder" else os.path.isfile)(path):
        raise table.error(key, phrase("error.absent", kind=kind, name=name))
    return path


def _declared() -> Iterator[Key]:
    text = (Path(__file__).parent / "keys.csv").read_text(encoding="utf-8")
    _, *rows = csv.reader(text.splitlines())
    yield from (Key(*row) for row in rows)


KEYS = tuple(_declared())
"""Keys in the order of reading and writing."""


def read_keys(file: Document) -> dict[str, dict[str, Any]]:
    """Return the values of the keys in a file by the first part of their fields, and by field."""
    found: dict[str, dict[str, Any]] = {
        "": {},
        "frame": {},
        "options": {},
        "photo_files": {},
        "statement": {},
    }
    for key in KEYS:
        table = file.optional(key.section)
        if key.name not in table or key.kind == "version":
            continue
        of, _, field = key.field.rpartition(".")
        with at_place(KeyPlace(table, key.name)):
            value = key.value(table, found[""].get("length", "m"))
            if of == "statement":
                field, value = _asked(field, value)
        found[of][field] = {**found[of].get(field, {}), **value} if field == "classes" else value
    return found


def _asked(field: str, value: Any) -> tuple[str, Any]:
    """Return an option of :meth:`photogram.Result.statement` and its checked value."""
    from photogram.results.statement.request import Asked
    from photogram.results.statement.texts import Texts

    if field.startswith(_CLASS):
        field, value = "classes", {field.removeprefix(_CLASS): value}
    if field == "language":
        Texts(value)
    # The existence of lengths is unknown before the tables are read.
    return field, getattr(Asked.checked(lengths=(_SOME_LENGTH,), **{field: value}), field)


def key_tables(
    values: Mapping[str, Any], statement: Mapping[str, Any], unit: str
) -> dict[str, Mapping[str, Any]]:
    """Return values by field, and the options of a statement, as sections of keys."""
    fields = {**values, **{f"statement.{name}": value for name, value in statement.items()}}
    fields |= {f"statement.{_CLASS}{name}": size for name, size in statement.get("classes", {}).items()}
    found: dict[str, dict[str, Any]] = {}
    for key in KEYS:
        found.setdefault(key.section, {})[key.name] = key.written(fields.get(key.field), unit)
    return dict(found)


def asked_files(asked: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the requested file of sentences by name; empty without."""
    if (sentences := asked.get("text")) is None:
        return {}
    lines = [f"{quoted_text(key)} = {quoted_text(sentence)}\n" for key, sentence in sentences.items()]
    return {SENTENCES: "".join(lines).encode()}


def read_sentences(path: Path) -> dict[str, str]:
    """Return sentences of a TOML file by key."""
    from photogram.results.statement.texts import Texts

    file = TomlFile(path)
    for key, sentence in file.content.items():
        if not isinstance(sentence, str):
            code = "plain.sentence-key" if isinstance(sentence, dict) else "error.text"
            message = phrase(code, value=value_field(sentence))
            raise file.error(key, phrase("error.at", what=key, message=message))
        try:
            Texts(own={key: sentence})
        except InputError as error:
            raise file.error(key, message_of(error)) from None
    return dict(file.content)
