"""What tests ask of messages: codes, fields and places, never sentences.

`nested_codes` lists codes. `traced` shows codes with the values of their fields, `described` with names and
values; `located` and `placed` add file and record.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pytest

from photogram import InputError, PhotogramError
from photogram.words import Phrase


def phrases(message: Any) -> Iterator[Phrase]:
    """Return the phrases of an error, a remark, a message or a list of these, and of their fields."""
    message = getattr(message, "phrase", message)
    if isinstance(message, Phrase):
        yield message
        message = list(message.fields.values())
    if isinstance(message, list | tuple):
        for value in message:
            yield from phrases(value)


def nested_codes(message: Any) -> list[str]:
    """Return the codes of a message and of those in its fields, the outermost first."""
    return [each.code for each in phrases(message)]


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else getattr(value, "code", value)


def has_code(message: Any, code: str, /, **fields: Any) -> bool:
    """Return whether an error, a remark or a message has a code, or one of its fields, with some fields.

    A phrase among the fields is compared by its code.
    """
    return any(
        each.code == code
        and all(_plain(each.fields[name]) == _plain(value) for name, value in fields.items())
        for each in phrases(message)
    )


def coded(code: str, /, **fields: Any) -> Callable[[Any], bool]:
    """Return a check of errors for `pytest.raises`: whether they have a code with some fields."""
    return lambda error: has_code(error, code, **fields)


def codes(messages: Any) -> list[str]:
    """Return the codes of remarks."""
    return [message.code for message in messages]


def fields_of(messages: Any, code: str) -> Mapping[str, Any]:
    """Return the fields of the first of some remarks that has a code."""
    return next(each.fields for each in phrases(list(messages)) if each.code == code)


def as_check(expected: str | Callable[[Any], bool]) -> Callable[[Any], bool]:
    """Return a check of errors: a check as it is, or whether place, codes and values contain some words."""
    if callable(expected):
        return expected
    return lambda error: expected in located(error) or re.search(expected, str(error)) is not None


@contextmanager
def raises(kind, code):
    """Require an error with a code; without codes, with a text that matches a pattern."""
    with pytest.raises(kind) as raised:
        yield raised
    assert code in nested_codes(raised.value) or re.search(code, str(raised.value)), raised.value


def traced(error):
    """Return codes and values of the message of an error: `error.key camera width_px: error.number nan`."""
    phrase = error if isinstance(error, Phrase) else getattr(error, "phrase", None)
    if phrase is None:
        return str(error)
    words, nested = [phrase.code], []
    for value in phrase.fields.values():
        if isinstance(value, Phrase):
            nested.append(traced(value))
        elif isinstance(value, list | tuple):
            words.append(",".join(traced(part) if isinstance(part, Phrase) else str(part) for part in value))
        else:
            words.append(str(value))
    return ": ".join([" ".join(words), *nested])


def located(error):
    """Return file and record of an error before its trace: `gnss.csv, record 3: error.cells 4 5`."""
    place = [error.file.name] if error.file else []
    place += [f"record {error.record}"] if error.record else []
    return f"{', '.join(place)}: {traced(error)}"


def check_message(words, error):
    """Check that place, codes and values of a message contain some words; without a code, its sentence."""
    if isinstance(error, Phrase):
        assert words in traced(error), traced(error)
    elif error.phrase is not None:
        assert words in located(error), located(error)
    else:
        assert words in str(error) or re.search(words, str(error)), str(error)


def check_words(words, error):
    """Check that the text of an error, or its codes and values, contain some words."""
    assert words in str(error) or words in traced(error), f"{error} {traced(error)}"


@contextmanager
def rejected(words, kind=InputError):
    """Expect an error whose place, codes and values contain some words."""
    with pytest.raises(kind) as caught:
        yield caught
    check_message(words, caught.value)


def described(message):
    """Return code and fields of an error, a remark or a phrase; without a code the text."""
    phrase = getattr(message, "phrase", message)
    if not hasattr(phrase, "code"):
        return str(message)
    fields = [f"{name}={described(value)}" for name, value in phrase.fields.items()]
    return " ".join([phrase.code, *fields])


@contextmanager
def refusal(*words, record=None):
    """Check that a call raises an error whose description contains the words, in a record of a file."""
    with pytest.raises(PhotogramError) as raised:
        yield raised
    for word in words:
        assert word in described(raised.value)
    if record is not None:
        assert raised.value.record == record


def placed(error):
    """Return code, fields, file and record of an error; of an error without a code its message."""
    fields = "" if error.phrase is None else _fields(error.phrase)
    place = [] if error.file is None else [str(error.file), f"record {error.record}"]
    return " ".join([*place, fields or error.message])


def _fields(phrase):
    if phrase.code == "error.at":
        what, message = phrase.fields["what"], phrase.fields["message"]
        return f"{what}: {_fields(message) if hasattr(message, 'code') else message}"
    values = [
        f"{name}={_fields(value) if hasattr(value, 'code') else value}"
        for name, value in phrase.fields.items()
    ]
    return " ".join([phrase.code, *values])


@contextmanager
def refused(*words):
    """Check that a call raises an `InputError` whose description contains the words, or matches them."""
    with pytest.raises(InputError) as raised:
        yield raised
    for word in words:
        description = placed(raised.value)
        assert word in description or re.search(word, description), description
