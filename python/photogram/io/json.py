"""JSON: the one form of all documents, and trees of what was read, whose errors name the path."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.files import read_bytes
from photogram.lazy_dataclasses import dataclass
from photogram.messages import quoted
from photogram.words import Phrase, phrase

_FORM = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_NON_STR_KEYS | orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE
LARGEST = 1e300


def to_json(document: object) -> bytes:
    """Return a document as JSON: UTF-8, two blanks a level, numbers to the last bit, a line end at its end.

    Arrays of NumPy are lists, data classes what their fields are, numbers as keys text, and what is not a
    number is null.
    """
    return orjson.dumps(document, default=_rows, option=_FORM)


def _rows(value: object) -> object:
    """Return the rows of an array that does not lie in memory row by row, or holds what is no number."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in a document")


@contextmanager
def holding(what: str, path: Path | None = None) -> Iterator[None]:
    """Say of what is no document, or has other members than were looked for, what it does not hold."""
    try:
        yield
    except InputError as error:
        raise InputError(error.phrase or error.message, file=path) from None
    except KeyError as error:
        raise InputError(f"holds no {what}: {error} is missing", file=path) from None
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"holds no {what}: {error}", file=path) from None


@dataclass(frozen=True)
class Tree:
    """A value within a file, and where it stands there."""

    value: Any
    file: Path
    path: str = ""

    def error(self, message: str | Phrase) -> InputError:
        """Return an error that names file and path."""
        located = phrase("error.at", what=self.path or phrase("error.document"), message=message)
        return InputError(located, file=self.file, text=repr(self.value)[:120])

    def _as(self, kind: type, word: str) -> Any:
        if not isinstance(self.value, kind) or isinstance(self.value, bool):
            raise self.error(f"is no {word}")
        return self.value

    def __contains__(self, key: str) -> bool:
        return isinstance(self.value, Mapping) and self.value.get(key) is not None

    def __getitem__(self, key: str) -> Tree:
        members = self._as(dict, "object")
        if key not in members:
            raise self.error(f"{key} is missing")
        return Tree(members[key], self.file, f"{self.path}/{key}")

    def get(self, key: str, default: Any) -> Tree:
        """Return a member, or a default where it is missing or null."""
        members = self._as(dict, "object")
        value = members.get(key)
        return Tree(default if value is None else value, self.file, f"{self.path}/{key}")

    def items(self) -> Iterator[tuple[str, Tree]]:
        """Yield the members of an object."""
        for key, value in self._as(dict, "object").items():
            yield key, Tree(value, self.file, f"{self.path}/{key}")

    def __iter__(self) -> Iterator[Tree]:
        for row, value in enumerate(self._as(list, "list")):
            yield Tree(value, self.file, f"{self.path}/{row}")

    def number(self) -> float:
        """Return a finite number."""
        if self.value is None:
            raise self.error("is null and must be a number")
        if not isinstance(self.value, int | float) or isinstance(self.value, bool):
            raise self.error("is no number")
        if not (abs(self.value) < LARGEST):
            raise self.error("is no finite number")
        return float(self.value)

    def whole(self, lowest: int = 0, highest: int = 2**31) -> int:
        """Return a whole number."""
        value = self.number()
        if not math.isfinite(value) or value != int(value) or not lowest <= value <= highest:
            raise self.error(f"is no whole number from {lowest} to {highest}")
        return int(value)

    def text(self) -> str:
        """Return a text."""
        value: str = self._as(str, "text")
        return value

    def numbers(self, count: int) -> Floats:
        """Return (count,) finite numbers."""
        found = [each.number() for each in self]
        if len(found) != count:
            raise self.error(f"has {len(found)} numbers, not {count}")
        return np.array(found)


def read_json(path: Path) -> Tree:
    """Read a JSON document."""
    data = read_bytes(path).removeprefix(b"\xef\xbb\xbf")
    try:
        return Tree(orjson.loads(data), path)
    except orjson.JSONDecodeError as error:
        lines = data.decode("utf-8", "replace").split("\n")
        record = min(error.lineno, len(lines))
        raise InputError(
            f"is no JSON: {error.msg}, column {error.colno}", file=path, record=record, text=lines[record - 1]
        ) from None


def unknown(tree: Tree, what: str, known: Mapping[str, Any]) -> InputError:
    """Return an error for a word that is none of those known."""
    return tree.error(f"{what} {quoted(str(tree.value))} is none of {', '.join(known)}")
