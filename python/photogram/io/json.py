"""JSON: format of all documents, and trees of read values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from photogram.arguments.arrays import value_field
from photogram.arguments.types import Floats
from photogram.errors import InputError, message_of
from photogram.io.files import read_bytes
from photogram.lazy_dataclasses import dataclass
from photogram.messages import unknown_name
from photogram.words import Phrase, phrase

_FORM = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_NON_STR_KEYS | orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE
LARGEST = 1e300


def to_json(document: object) -> bytes:
    """Return a document as JSON: UTF-8, indented, exact numbers.

    Arrays of NumPy become lists, dataclasses objects, numeric keys text, and NaN and infinite numbers null.
    """
    return orjson.dumps(document, default=_rows, option=_FORM)


CLOSED = b"\n  ]\n}\n"  # End of a document whose last member is a list of any length


def opened(document: Mapping[str, object], name: str) -> bytes:
    """Return a document up to the first element of the list that is its last member."""
    return to_json(document).removesuffix(b"\n}\n") + f',\n  "{name}": ['.encode()


def elements(rows: Iterable[Mapping[str, object]]) -> bytes:
    """Return elements of this list, one per line, separated by commas."""
    lines = b",\n    ".join(map(orjson.dumps, rows))
    return b"\n    " + lines if lines else b""


def _rows(value: object) -> object:
    """Return the rows of an unusual array as lists."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"a JSON document cannot contain {type(value).__name__}")


@contextmanager
def holding(what: str, path: Path | None = None) -> Iterator[None]:
    """Report errors of a document with missing or unexpected members."""
    try:
        yield
    except InputError as error:
        raise InputError(message_of(error), file=path) from None
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        missing = isinstance(error, KeyError)
        reason = phrase("error.missing", name=str(error)) if missing else phrase("error.member")
        raise InputError(phrase("error.content", content=what, reason=reason), file=path) from None


@dataclass(frozen=True)
class Tree:
    """A value of a JSON file and its path."""

    value: Any
    file: Path
    path: str = ""

    def error(self, message: str | Phrase) -> InputError:
        """Return an error that contains file and path."""
        located = phrase("error.at", what=self.path or phrase("error.document"), message=message)
        return InputError(located, file=self.file, text=repr(self.value)[:120])

    def _as(self, kind: type, code: str) -> Any:
        if not isinstance(self.value, kind) or isinstance(self.value, bool):
            raise self._error(code)
        return self.value

    def _error(self, code: str, **fields: Any) -> InputError:
        return self.error(phrase(code, value=value_field(self.value), **fields))

    def __contains__(self, key: str) -> bool:
        return isinstance(self.value, Mapping) and self.value.get(key) is not None

    def __getitem__(self, key: str) -> Tree:
        members = self._as(dict, "error.table")
        if key not in members:
            raise self.error(phrase("error.missing", name=key))
        return Tree(members[key], self.file, f"{self.path}/{key}")

    def get(self, key: str, default: Any) -> Tree:
        """Return a member, or a default if it is missing or null."""
        value = self._as(dict, "error.table").get(key)
        return Tree(default if value is None else value, self.file, f"{self.path}/{key}")

    def items(self) -> Iterator[tuple[str, Tree]]:
        """Yield the members of an object."""
        for key, value in self._as(dict, "error.table").items():
            yield key, Tree(value, self.file, f"{self.path}/{key}")

    def __iter__(self) -> Iterator[Tree]:
        for row, value in enumerate(self._as(list, "error.list")):
            yield Tree(value, self.file, f"{self.path}/{row}")

    def number(self) -> float:
        """Return a finite number."""
        if not isinstance(self.value, int | float) or isinstance(self.value, bool):
            raise self._error("error.number")
        if not (abs(self.value) < LARGEST):
            raise self._error("error.finite")
        return float(self.value)

    def whole(self, lowest: int = 0, highest: int = 2**31) -> int:
        """Return a whole number."""
        value = self.number()
        if not math.isfinite(value) or value != int(value) or not lowest <= value <= highest:
            raise self._error("error.whole-range", low=lowest, high=highest)
        return int(value)

    def text(self) -> str:
        """Return a text."""
        value: str = self._as(str, "error.text")
        return value

    def numbers(self, count: int) -> Floats:
        """Return (count,) finite numbers."""
        values = [member.number() for member in self]
        if len(values) != count:
            raise self.error(phrase("error.count", count=count, actual=len(values)))
        return np.array(values)


def read_json(path: Path) -> Tree:
    """Read a JSON document."""
    data = read_bytes(path).removeprefix(b"\xef\xbb\xbf")
    try:
        return Tree(orjson.loads(data), path)
    except orjson.JSONDecodeError as error:
        lines = data.decode("utf-8", "replace").split("\n")
        record = min(error.lineno, len(lines))
        reason = phrase("error.at-column", message=error.msg, column=error.colno)
        message = phrase("error.parse", format="JSON", reason=reason)
        raise InputError(message, file=path, record=record, text=lines[record - 1]) from None


def unknown(tree: Tree, what: str, known: Mapping[str, Any]) -> InputError:
    """Return an error for an unknown word."""
    return tree.error(unknown_name(what, str(tree.value), known))
