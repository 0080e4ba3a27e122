"""TOML files, and sections with keys in them: errors name the line."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any, NoReturn

from photogram.arguments.arrays import shown
from photogram.errors import InputError
from photogram.io.files import read_bytes
from photogram.io.places import Place
from photogram.messages import nearest
from photogram.words import Phrase

MOST_DIGITS = 1000
_ENDLESS = re.compile(rf"\d[\d_]{{{MOST_DIGITS}}}")
"""Python refuses whole numbers of thousands of digits, and does not say where they stand."""
_SHOWN = 60  # Characters of a key that an error shows


class TomlFile:
    """The content of a file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            text = read_bytes(path).decode("utf-8-sig").replace("\r\n", "\n")
        except UnicodeDecodeError as error:
            raise InputError(
                f"is no text of UTF-8: {error.reason} at byte {error.start}", file=path
            ) from None
        self.lines = text.split("\n")
        if (endless := _ENDLESS.search(text)) is not None:
            place = self._place(text.count("\n", 0, endless.start()) + 1)
            key = (place.text or "").split("=")[0].strip()[:_SHOWN]
            raise InputError(
                f"{key} has a number of more than {MOST_DIGITS} digits", file=path, record=place.record
            )
        try:
            self.content: Mapping[str, Any] = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            where = re.search(r"at line (\d+)", str(error))
            raise self._place(int(where[1]) if where else None).error(f"is no TOML: {error}") from None
        except RecursionError:
            raise InputError("brackets are nested too deeply", file=path) from None

    def _place(self, record: int | None) -> Place:
        known = record is not None and record <= len(self.lines)
        return Place(self.path, record, self.lines[record - 1] if record and known else None)

    def error(self, key: str, message: str | Phrase, section: str = "") -> InputError:
        """Return an error at the first line that has a key or table: of the section, if there."""
        return self.place(key, section).error(message)

    def place(self, key: str, section: str = "") -> Place:
        """Return the first line that has a key or table: of the section, if there."""
        word = rf"[\"']?{re.escape(key)}[\"']?\s*[\]=.]"
        own, every = list(self._lines_of(section)), list(enumerate(self.lines, 1))
        first = rf"^\s*\[?\[?\s*{word}"
        # Inline tables and names with points have their keys amid a line.
        for lines, pattern in ((own, first), (own, rf"^[^#]*[\[{{,.\s]{word}"), (every, first)):
            for record, line in lines:
                if re.match(pattern, line):
                    return self._place(record)
        return self._place(None)

    def _lines_of(self, section: str) -> Iterator[tuple[int, str]]:
        """Yield the lines of a section with their numbers: below its header, or with its name before keys."""
        word = rf"\s*[\"']?{re.escape(section)}[\"']?\s*"
        below, inside = False, False
        for record, line in enumerate(self.lines, 1):
            if line.lstrip().startswith("["):
                below, inside = True, re.match(rf"\s*\[+{word}[\].]", line) is not None
            if inside or (not below and re.match(rf"{word}[=.]", line)):
                yield record, line


def day_of(value: object) -> date:
    """Return a day of TOML, or of a text such as 1983-07-02; `ValueError` where it is none."""
    # A time of a day is a date of Python's, too.
    return value if type(value) is date else date.fromisoformat(value if isinstance(value, str) else "")


def quoted_text(text: str) -> str:
    """Return a text as files of TOML have it, between quotation marks."""
    # Strings of JSON are strings of TOML, but for the one control character that JSON leaves as it is.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


class Sections(TomlFile):
    """A file of sections with keys; errors name file, line and text.

    `said` are values that replace those of the file: `section.key=value`, texts with or without quotes.
    """

    def __init__(self, path: Path, said: Sequence[str] = ()) -> None:
        super().__init__(path)
        self._said: dict[tuple[str, str], str] = {}
        content = dict(self.content)
        for each in said:
            name, equals, value = each.partition("=")
            section, point, key = name.strip().partition(".")
            if not (equals and point and section and key):
                raise InputError(f"--set {each}: SECTION.KEY=VALUE, as film.model=affine")
            if not isinstance(content.get(section, {}), dict):
                self.fail("", section, f"{section} is no section")
            content[section] = {**content.get(section, {}), key: _value(value.strip())}
            self._said[section, key] = each
        self.content = content

    def fail(self, section: str, key: str, message: str | Phrase) -> NoReturn:
        """Raise an error at the first line of a section that has the key; without a section, of the file."""
        given = [each for (own, name), each in self._said.items() if (own, name) == (section, key)]
        given += [each for (own, _), each in self._said.items() if (section, key) == ("", own)]
        if given:
            raise InputError(f"--set {given[0]}: {message}", file=self.path)
        raise self.error(key, message, section)

    def check_keys(self, known: Mapping[str, Collection[str] | None]) -> None:
        """Refuse sections and keys that there are not; None: keys are names that people choose."""
        for section, values in self.content.items():
            if section not in known:
                self.fail("", section, f"there is no section [{section}]{nearest(section, known)}")
            if not isinstance(values, dict):
                self.fail("", section, f"{section} is no section")
            keys = known[section]
            for key in values:
                if keys is not None and key not in keys:
                    self.fail(section, key, f"[{section}] has no key {key}{nearest(key, keys)}")

    def has(self, section: str, key: str) -> bool:
        """Whether a key is there."""
        return key in self.content.get(section, {})

    def value(self, section: str, key: str, default: Any = None) -> Any:
        """Return what a key has."""
        return self.content.get(section, {}).get(key, default)

    def text(self, section: str, key: str) -> str:
        """Return a text; empty where the key is not there."""
        value = self.value(section, key, "")
        if not isinstance(value, str):
            self.fail(section, key, f"{key} is no text: {shown(value)}")
        return value

    def texts(self, section: str, key: str) -> tuple[str, ...]:
        """Return a list of texts."""
        value = self.value(section, key)
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            self.fail(section, key, f"{key} is a list of texts, not {shown(value)}")
        return tuple(value)

    def flag(self, section: str, key: str) -> bool:
        """Return true or false."""
        value = self.value(section, key)
        if not isinstance(value, bool):
            self.fail(section, key, f"{key} is true or false, not {shown(value)}")
        return value

    def count(self, section: str, key: str) -> int:
        """Return a whole number of at least 1."""
        value = self.value(section, key)
        if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value < 2**31:
            self.fail(section, key, f"{key} must be a whole number from 1 to {2**31 - 1}, got {shown(value)}")
        return value

    def numbers(self, section: str, key: str, counts: tuple[int, ...]) -> tuple[float, ...]:
        """Return a number, or some of them."""
        value = self.value(section, key)
        listed = value if isinstance(value, list) else [value]
        good = all(isinstance(each, int | float) and not isinstance(each, bool) for each in listed)
        if not good or len(listed) not in counts:
            self.fail(section, key, f"{key} is {' or '.join(map(str, counts))} numbers, not {shown(value)}")
        return tuple(float_of(each) for each in listed)


def _value(text: str) -> Any:
    """Return what a value is as TOML has it, or as a text."""
    try:
        (value,) = tomllib.loads(f"value = {text}").values()
    except ValueError:  # TOMLDecodeError, endless numbers, and a line that says more than one value
        return text
    return value


def float_of(value: float) -> float:
    """Return a number as a float: infinite if a whole number is beyond double precision."""
    if isinstance(value, int) and abs(value) >= 2**1023:
        return math.inf if value > 0 else -math.inf
    return float(value)
