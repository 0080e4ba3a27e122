"""Sections and keys of `project.toml`: what they have, and errors at the line where it stands."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any, NoReturn

from photogram.arguments.arrays import shown
from photogram.io.toml import TomlFile
from photogram.messages import nearest

__all__ = ["Sections"]


class Sections(TomlFile):
    """A file of sections with keys; all errors are :class:`photogram.InputError` with file, line and text."""

    def fail(self, section: str, key: str, message: str) -> NoReturn:
        """Raise an error at the first line of a section that has the key; without a section, of the file."""
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


def _number(value: float) -> float:
    """Return a number; whole ones that no number with decimals can be are infinite."""
    if isinstance(value, int) and abs(value) >= 2**1023:
        return math.inf if value > 0 else -math.inf
    return float(value)
