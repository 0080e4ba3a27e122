"""The one form of all JSON documents, and how they are read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import orjson

from photogram.errors import InputError

__all__ = ["holding", "to_json"]

_FORM = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_NON_STR_KEYS | orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE


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
    """Say of what is no document, or has other members than were looked for, what it does not hold.

    Raises
    ------
    InputError
        It holds no such thing; what was wrong with a member names the file, too.
    """
    try:
        yield
    except InputError as error:
        raise InputError(error.message, file=path) from None
    except KeyError as error:
        raise InputError(f"holds no {what}: {error} is missing", file=path) from None
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"holds no {what}: {error}", file=path) from None
