"""Errors of arguments, and validation of arguments that are objects of a class; without arrays."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path

from photogram.errors import InputError
from photogram.messages import unknown_name
from photogram.words import Phrase, phrase


def value_field(value: object) -> str | float | Phrase:
    """Return a value as a field of a message: text, number, or short description."""
    if isinstance(value, int) and value.bit_length() > 128:
        return phrase("error.long-integer", bits=value.bit_length())
    if isinstance(value, str) or (isinstance(value, int | float) and not isinstance(value, bool)):
        return value
    try:
        return phrase("error.value", value=" ".join(ascii(value).split())[:80])
    except Exception:  # A foreign object may raise any error, a deeply nested one a RecursionError
        return phrase("error.object", type=type(value).__name__)


def argument_error(name: str, code: str, /, **fields: object) -> InputError:
    """Return the error of an argument; `code` is a message code without `error.`."""
    texts = {key: str(value) if isinstance(value, tuple) else value for key, value in fields.items()}
    if "value" in fields and not isinstance(fields["value"], Phrase):
        texts["value"] = value_field(fields["value"])
    return InputError(phrase("error.at", what=name, message=phrase(f"error.{code}", **texts)))


def kind_error(name: str, kind: str, value: object) -> InputError:
    """Return the error of a wrong type; `kind` is, e.g., `a Spheroid or None`."""
    return argument_error(name, "kind", kind=kind, value=value)


def require_kind(name: str, value: object, kind: type, *, optional: bool = False) -> object:
    """Return an argument; reject one that is not an instance of a class."""
    if not (isinstance(value, kind) or (optional and value is None)):
        raise kind_error(name, f"{kind.__name__} or None" if optional else kind.__name__, value)
    return value


def path_of(name: str, value: object) -> Path:
    """Return a path from a string or a path-like object."""
    try:
        text = os.fspath(value)  # type: ignore[call-overload]
        os.fsencode(text)
    except (TypeError, UnicodeEncodeError):
        raise kind_error(name, "a path", value) from None
    if not isinstance(text, str) or not text or "\0" in text:
        raise kind_error(name, "a path without NUL characters" if text else "a path", value)
    return value if isinstance(value, Path) else Path(text)


def require(condition: object, name: str, code: str, /, **fields: object) -> None:
    """Reject an argument if a condition is false; see `argument_error`."""
    if not condition:
        raise argument_error(name, code, **fields)


def require_name(kind: str | Phrase, name: str, names: Collection[str]) -> None:
    """Reject a name that does not exist; the error has the nearest name, or all names."""
    if name not in names:
        raise InputError(unknown_name(kind, name, names))
