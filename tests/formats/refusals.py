"""Errors by their codes, fields and places, which tests ask for instead of sentences."""

from contextlib import contextmanager

import pytest

from photogram import InputError


def described(error):
    """Return code, fields, file and record of an error; of an error without a code its message."""
    fields = "" if error.phrase is None else _fields(error.phrase)
    place = [] if error.file is None else [str(error.file), f"record {error.record}"]
    return " ".join([*place, fields or error.message])


def _fields(phrase):
    values = [
        f"{name}={_fields(value) if hasattr(value, 'code') else value}"
        for name, value in phrase.fields.items()
    ]
    return " ".join([phrase.code, *values])


@contextmanager
def refused(*words):
    """Check that a call raises an `InputError` whose description contains the words."""
    with pytest.raises(InputError) as raised:
        yield raised
    for word in words:
        assert word in described(raised.value)
