"""Errors and remarks by code, fields and place, which tests ask for instead of sentences."""

from contextlib import contextmanager

import pytest

from photogram import PhotogramError


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
