"""What tests ask of messages: codes with fields, never sentences."""

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from photogram.words import Phrase
from rejections import located


def phrases(message: Any) -> Iterator[Phrase]:
    """Return the phrases of a message: of itself, and of its fields."""
    if isinstance(message, Phrase):
        yield message
        for value in message.fields.values():
            yield from phrases(value)
    elif isinstance(message, list | tuple):
        for value in message:
            yield from phrases(value)


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else getattr(value, "code", value)


def has_code(message: Any, code: str, /, **fields: Any) -> bool:
    """Return whether an error, a remark or a message has a code, or one of its fields, with some fields.

    A phrase among the fields is compared by its code.
    """
    return any(
        each.code == code
        and all(_plain(each.fields[name]) == _plain(value) for name, value in fields.items())
        for each in phrases(getattr(message, "phrase", message))
    )


def coded(code: str, /, **fields: Any) -> Callable[[Any], bool]:
    """Return a check of errors for `pytest.raises`: whether they have a code with some fields."""
    return lambda error: has_code(error, code, **fields)


def codes(messages: Any) -> list[str]:
    """Return the codes of remarks."""
    return [message.code for message in messages]


def fields_of(messages: Any, code: str) -> Mapping[str, Any]:
    """Return the fields of the first of some remarks that has a code."""
    return next(each.fields for message in messages for each in phrases(message.phrase) if each.code == code)


def as_check(expected: str | Callable[[Any], bool]) -> Callable[[Any], bool]:
    """Return a check of errors: a check as it is, or whether place, codes and values contain some words."""
    if callable(expected):
        return expected
    return lambda error: expected in located(error) or re.search(expected, str(error)) is not None
