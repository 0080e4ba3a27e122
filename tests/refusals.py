"""Errors by their codes, fields and places, which tests ask for instead of sentences."""

import re
from contextlib import contextmanager

import pytest

from photogram import InputError


def described(error):
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
        description = described(raised.value)
        assert word in description or re.search(word, description), description


def fields_of(messages, code):
    """Return the fields of the first message with a code."""
    return next(message.phrase.fields for message in messages if message.code == code)
