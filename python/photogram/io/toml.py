"""TOML files whose errors name the line."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from datetime import date
from pathlib import Path
from typing import Any

from photogram.errors import InputError
from photogram.io.files import read_bytes
from photogram.io.places import Place

__all__ = ["TomlFile", "day_of", "quoted_text"]

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

    def error(self, key: str, message: str, section: str = "") -> InputError:
        """Return an error at the first line that has a key or table: of the section, if there."""
        word = rf"[\"']?{re.escape(key)}[\"']?\s*[\]=.]"
        own, every = list(self._lines_of(section)), list(enumerate(self.lines, 1))
        first = rf"^\s*\[?\[?\s*{word}"
        # Inline tables and names with points have their keys amid a line.
        for lines, pattern in ((own, first), (own, rf"^[^#]*[\[{{,.\s]{word}"), (every, first)):
            for record, line in lines:
                if re.match(pattern, line):
                    return self._place(record).error(message)
        return self._place(None).error(message)

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
