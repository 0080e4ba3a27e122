"""Codes of a message and of the messages in its fields."""

import re
from contextlib import contextmanager

import pytest

from photogram.words import Phrase


def codes(message):
    """Return the codes of a phrase, or of the phrase of a remark, finding or error, outermost first."""
    if not isinstance(message, Phrase | list | tuple):
        message = getattr(message, "phrase", None)
    if isinstance(message, Phrase):
        return [message.code, *(code for field in message.fields.values() for code in codes(field))]
    return [code for part in message or () for code in codes(part)]


@contextmanager
def raises(kind, code):
    """Require an error with a code; without codes, with a text that matches a pattern."""
    with pytest.raises(kind) as raised:
        yield raised
    assert code in codes(raised.value) or re.search(code, str(raised.value)), raised.value
