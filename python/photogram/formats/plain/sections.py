"""Sections and keys of `project.toml`: what they have, and errors at the line where it stands."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from photogram.arguments.arrays import shown
from photogram.errors import InputError
from photogram.io.toml import TomlFile
from photogram.messages import nearest

__all__ = ["Sections"]


class Sections(TomlFile):
    """A file of sections with keys; all errors are :class:`photogram.InputError` with file, line and text.

    Parameters
    ----------
    path
        The file.
    said
        What a user says of keys in the place of the file: `section.key=value`, the value as in the file; a
        text may go without its quotation marks.

    Raises
    ------
    InputError
        The file cannot be read, or is no TOML; words of another form.
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

    def fail(self, section: str, key: str, message: str) -> NoReturn:
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

    def numbers(self, section: str, key: str, counts: tuple[int, ...]) -> tuple[float, ...]:
        """Return a number, or some of them."""
        value = self.value(section, key)
        listed = value if isinstance(value, list) else [value]
        good = all(isinstance(each, int | float) and not isinstance(each, bool) for each in listed)
        if not good or len(listed) not in counts:
            self.fail(section, key, f"{key} is {' or '.join(map(str, counts))} numbers, not {shown(value)}")
        return tuple(_number(each) for each in listed)


def _value(text: str) -> Any:
    """Return what a value is as TOML has it, or as a text."""
    try:
        (value,) = tomllib.loads(f"value = {text}").values()
    except ValueError:  # TOMLDecodeError, endless numbers, and a line that says more than one value
        return text
    return value


def _number(value: float) -> float:
    """Return a number; whole ones that no number with decimals can be are infinite."""
    if isinstance(value, int) and abs(value) >= 2**1023:
        return math.inf if value > 0 else -math.inf
    return float(value)
