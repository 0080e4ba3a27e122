"""Sections `[check]` and `[statement]` of `project.toml`: what a project asks of its accuracy statement."""

from __future__ import annotations

import datetime
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from photogram.arguments.arrays import shown
from photogram.errors import InputError
from photogram.io.toml import Sections, TomlFile, quoted_text
from photogram.results.statement.request import Asked, length_of
from photogram.results.statement.texts import Texts

KEYS: Mapping[str, tuple[str, ...]] = {
    "check": ("survey_common_sd", "survey_common_in_control", "independent"),
    "statement": (
        *("standards", "class_h", "class_v", "class_3d", "area", "without", "language", "text", "budgets"),
        *("coverage", "title", "project", "client", "firm", "surveyor", "date", "length_limit", "expansion"),
    ),
}
"""Of the sections."""
CLASS = "class_"
_NAMES = {"length_limit": "limit"}
"""Keys that are called otherwise in :class:`photogram.results.statement.request.Asked`."""
SENTENCES = "sentences.toml"
"""The file that sentences are written to."""

SOME_LENGTH = {"line": "1", "from": "A", "to": "B", "length": 1.0, "sd": 0.0}


def read_asked(file: Sections, unit: str) -> dict[str, Any]:
    """Return what the sections ask, as :meth:`photogram.Result.statement` takes it."""
    found: dict[str, Any] = {}
    for section, keys in KEYS.items():
        for key in keys:
            if not file.has(section, key):
                continue
            name, value = _NAMES.get(key, key), _value(file, section, key, unit)
            if key.startswith(CLASS):
                name, value = "classes", {key.removeprefix(CLASS): value}
            value = _checked(file, section, key, {name: value})[name]
            found[name] = {**found.get(name, {}), **value} if name == "classes" else value
    return found


def _checked(file: Sections, section: str, key: str, asked: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is asked as a statement takes it; what it refuses is an error of the line."""
    try:
        if key == "language":
            Texts(asked[key])
        # Whether there are lengths is not known before the tables are read.
        checked = Asked.checked(lengths=(SOME_LENGTH,), **asked)
    except InputError as error:
        file.fail(section, key, error.message)
    return {name: getattr(checked, name) for name in asked}


def _value(file: Sections, section: str, key: str, unit: str) -> Any:
    """Return what a key has."""
    match key:
        case "survey_common_sd":
            return file.numbers(section, key, (1, 3))
        case "survey_common_in_control":
            return file.flag(section, key)
        case "standards" | "budgets":
            return file.texts(section, key)
        case "class_h" | "class_v" | "class_3d" | "area":
            return _length(file, section, key, unit)
        case "coverage" | "expansion":
            return _finite(file, section, key)
        case "length_limit":
            constant, slope, most = file.numbers(section, key, (3,))
            if not (math.isfinite(constant) and math.isfinite(slope)):
                file.fail(section, key, f"{key} is A, K and B of A + K L <= B, of which B may be infinite")
            return constant, slope, most
        case "without":
            return _reasons(file, section, key)
        case "text":
            return _sentences(file, section, key)
        case "date" if type(value := file.value(section, key)) is datetime.date:
            return value.isoformat()
        case _:
            return file.text(section, key)


def _length(file: Sections, section: str, key: str, unit: str) -> float:
    value = file.value(section, key)
    try:
        return length_of(value if isinstance(value, str) else shown(value), unit, area=key == "area")
    except InputError as error:
        file.fail(section, key, f"{key}: {error.message}")


def _finite(file: Sections, section: str, key: str) -> float:
    (found,) = file.numbers(section, key, (1,))
    if not math.isfinite(found):
        file.fail(section, key, f"{key} is a finite number, not {found}")
    return found


def _reasons(file: Sections, section: str, key: str) -> dict[str, str]:
    value = file.value(section, key)
    if not isinstance(value, dict):
        file.fail(section, key, f'{key} is {{ C07 = "target moved" }}, not {shown(value)}')
    for point, reason in value.items():
        if not isinstance(reason, str) or not reason.strip():
            file.fail(section, point, f'{point} is left out for a reason: {point} = "target moved"')
    return value


def _sentences(file: Sections, section: str, key: str) -> dict[str, str]:
    path = file.path.parent / file.text(section, key)
    if not os.path.isfile(path):  # nor where the name is too long for the system
        file.fail(section, key, f"the file of sentences is not there: {path}")
    return read_sentences(path)


def asked_lines(asked: Mapping[str, Any], unit: str) -> list[str]:
    """Return the lines of the sections, which :func:`read_asked` reads again; none where nothing is asked."""
    found = []
    for section, keys in KEYS.items():
        lines = [f"{key} = {_written(own)}" for key in keys if (own := _said(asked, key, unit)) is not None]
        if lines:
            found += [f"[{section}]", *lines, ""]
    return found


def _said(asked: Mapping[str, Any], key: str, unit: str) -> Any:
    """Return what a key is to have; None where nothing is asked."""
    if key.startswith(CLASS):
        size = asked.get("classes", {}).get(key.removeprefix(CLASS))
        return None if size is None else f"{float(size)!r}{unit}"
    value = asked.get(_NAMES.get(key, key))
    if value is None:
        return None
    if key == "area":
        return f"{float(value)!r}{unit}2"
    return SENTENCES if key == "text" else value


def _written(value: Any) -> str:
    """Return a value as TOML has it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return quoted_text(value)
    if isinstance(value, Mapping):
        pairs = (f"{quoted_text(name)} = {_written(own)}" for name, own in value.items())
        return f"{{ {', '.join(pairs)} }}" if value else "{}"
    if isinstance(value, int | float):
        return repr(float(value))
    return f"[{', '.join(map(_written, value))}]"


def asked_files(asked: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the file of sentences that is asked for, by its name; none without."""
    if (sentences := asked.get("text")) is None:
        return {}
    lines = [f"{quoted_text(key)} = {quoted_text(sentence)}\n" for key, sentence in sentences.items()]
    return {SENTENCES: "".join(lines).encode()}


def read_sentences(path: Path) -> dict[str, str]:
    """Return the sentences of a TOML file by their keys: `"asprs.tested.h" = "Tested with {n} points."`."""
    file = TomlFile(path)
    for key, sentence in file.content.items():
        if isinstance(sentence, dict):
            raise file.error(key, f'{key} is no key: keys stand in quotation marks, "asprs.tested.h" = "..."')
        if not isinstance(sentence, str):
            raise file.error(key, f"{key} is no sentence: {shown(sentence)}")
        try:
            Texts(own={key: sentence})
        except InputError as error:
            raise file.error(key, error.message) from None
    return dict(file.content)
