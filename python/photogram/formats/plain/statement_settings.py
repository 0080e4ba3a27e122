"""Sections `[check]` and `[statement]` of `project.toml`."""

from __future__ import annotations

import datetime
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from photogram.arguments.arrays import value_field
from photogram.errors import InputError, message_of
from photogram.io.places import at_place
from photogram.io.toml import Document, KeyPlace, Table, TomlFile, quoted_text
from photogram.results.statement.request import Asked, length_of
from photogram.results.statement.texts import Texts
from photogram.words import phrase

KEYS: Mapping[str, tuple[str, ...]] = {
    "check": ("survey_common_sd", "survey_common_in_control", "independent"),
    "statement": (
        *("standards", "class_h", "class_v", "class_3d", "area", "without", "language", "text", "budgets"),
        *("coverage", "title", "project", "client", "firm", "surveyor", "date", "length_limit", "expansion"),
    ),
}
"""Keys of the sections."""
CLASS = "class_"
_NAMES = {"length_limit": "limit"}
"""Keys with other names in :class:`photogram.results.statement.request.Asked`."""
SENTENCES = "sentences.toml"  # File for sentences

SOME_LENGTH = {"line": "1", "from": "A", "to": "B", "length": 1.0, "sd": 0.0}


def read_asked(file: Document, unit: str) -> dict[str, Any]:
    """Return the options of :meth:`photogram.Result.statement` in the sections."""
    found: dict[str, Any] = {}
    for section, keys in KEYS.items():
        table = file.optional(section)
        for key in keys:
            if key not in table:
                continue
            with at_place(KeyPlace(table, key)):
                name, value = _NAMES.get(key, key), _value(table, key, unit)
                if key.startswith(CLASS):
                    name, value = "classes", {key.removeprefix(CLASS): value}
                if key == "language":
                    Texts(value)
                # The existence of lengths is unknown before the tables are read.
                value = getattr(Asked.checked(lengths=(SOME_LENGTH,), **{name: value}), name)
            found[name] = {**found.get(name, {}), **value} if name == "classes" else value
    return found


def _value(table: Table, key: str, unit: str) -> Any:
    value = table.values[key]
    match key:
        case "survey_common_sd":
            return tuple(table.numbers(key, (1, 3)))
        case "survey_common_in_control":
            return table.switch(key)
        case "standards" | "budgets":
            return table.texts(key)
        case "class_h" | "class_v" | "class_3d" | "area":
            length = value if isinstance(value, str) else str(value_field(value))
            return length_of(length, unit, area=key == "area")
        case "coverage" | "expansion":
            return table.number(key)
        case "length_limit":
            constant, slope, most = table.numbers(key, 3)
            if not (math.isfinite(constant) and math.isfinite(slope)):
                raise table.value_error(key, "plain.length-limit")
            return constant, slope, most
        case "without":
            reasons = table.table(key)
            for point in reasons.values:
                if not reasons.text(point).strip():
                    raise reasons.error(point, phrase("plain.reason"))
            return value
        case "text":
            path = table.file.parent / table.text(key)
            if not os.path.isfile(path):  # Also if the name is too long for the system
                raise table.error(key, phrase("error.absent", kind="file", name=str(path)))
            return read_sentences(path)
        case "date" if type(value) is datetime.date:
            return value.isoformat()
        case _:
            return table.text(key)


def asked_tables(asked: Mapping[str, Any], unit: str) -> dict[str, Mapping[str, Any]]:
    """Return the sections by name, in the form for :func:`read_asked`."""
    return {section: {key: _said(asked, key, unit) for key in keys} for section, keys in KEYS.items()}


def _said(asked: Mapping[str, Any], key: str, unit: str) -> Any:
    """Return the value of a key; None if it is not set."""
    if key.startswith(CLASS):
        size = asked.get("classes", {}).get(key.removeprefix(CLASS))
        return None if size is None else f"{float(size)!r}{unit}"
    value = asked.get(_NAMES.get(key, key))
    if value is None:
        return None
    if key == "area":
        return f"{float(value)!r}{unit}2"
    return SENTENCES if key == "text" else value


def asked_files(asked: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the requested file of sentences by name; empty without."""
    if (sentences := asked.get("text")) is None:
        return {}
    lines = [f"{quoted_text(key)} = {quoted_text(sentence)}\n" for key, sentence in sentences.items()]
    return {SENTENCES: "".join(lines).encode()}


def read_sentences(path: Path) -> dict[str, str]:
    """Return sentences of a TOML file by key."""
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
