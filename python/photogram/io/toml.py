"""TOML files whose errors name the line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from photogram.errors import InputError
from photogram.io.files import read_bytes
from photogram.io.places import Place

__all__ = ["TomlFile"]

MOST_DIGITS = 1000
_ENDLESS = re.compile(rf"\d[\d_]{{{MOST_DIGITS}}}")
"""Python refuses whole numbers of thousands of digits, and does not say where they stand."""
_SHOWN = 60
"""Characters of a key that an error shows."""


class TomlFile:
    """The content of a file.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    InputError
        It cannot be read, or is no TOML.
    """

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

    def error(self, key: str, message: str) -> InputError:
        """Return an error at the first line that has a key or a table of this name."""
        pattern = re.compile(rf"^\s*\[?\[?\s*[\"']?{re.escape(key)}[\"']?\s*[\]=.]")
        found = (record for record, line in enumerate(self.lines, 1) if pattern.match(line))
        return self._place(next(found, None)).error(message)
