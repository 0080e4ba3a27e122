"""JSON, the format of all documents."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import orjson

from photogram.errors import InputError, message_of
from photogram.io.files import read_bytes, utf8_text
from photogram.io.tree import Tree
from photogram.words import phrase

_FORM = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_NON_STR_KEYS | orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE


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
        raise (error if error.file else InputError(message_of(error), file=path)) from None
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        missing = isinstance(error, KeyError)
        reason = phrase("error.missing", name=str(error)) if missing else phrase("error.member")
        raise InputError(phrase("error.content", content=what, reason=reason), file=path) from None


def read_json(path: Path) -> Tree:
    data = read_bytes(path).removeprefix(b"\xef\xbb\xbf")
    try:
        return Tree(orjson.loads(data), path)
    except orjson.JSONDecodeError as error:
        lines = utf8_text(data, path).split("\n")
        record = min(error.lineno, len(lines))
        reason = phrase("error.at-column", message=error.msg, column=error.colno)
        message = phrase("error.parse", format="JSON", reason=reason)
        raise InputError(message, file=path, record=record, text=lines[record - 1]) from None
