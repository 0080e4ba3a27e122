"""The one form of all JSON documents."""

from __future__ import annotations

import orjson

__all__ = ["to_json"]

_FORM = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_NON_STR_KEYS | orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE


def to_json(document: object) -> bytes:
    """Return a document as JSON: UTF-8, two blanks a level, numbers to the last bit, a line end at its end.

    Arrays of NumPy are lists, numbers as keys are text, and what is not a number is null.
    """
    return orjson.dumps(document, option=_FORM)
