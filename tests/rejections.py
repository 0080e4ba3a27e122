"""Errors of input by codes and fields: tests ask for these and never for sentences."""

import re
from contextlib import contextmanager

import pytest

from photogram import InputError
from photogram.words import Phrase


def traced(error):
    """Return codes and values of the message of an error: `error.key camera width_px: error.number nan`."""
    phrase = error if isinstance(error, Phrase) else getattr(error, "phrase", None)
    if phrase is None:
        return str(error)
    words, nested = [phrase.code], []
    for value in phrase.fields.values():
        if isinstance(value, Phrase):
            nested.append(traced(value))
        else:
            words.append(
                ",".join(traced(part) if isinstance(part, Phrase) else str(part) for part in value)
                if isinstance(value, list | tuple)
                else str(value)
            )
    return ": ".join([" ".join(words), *nested])


def check_message(words, error):
    """Check that codes and values of a message contain some words; without a code, its sentence."""
    if isinstance(error, Phrase) or error.phrase is not None:
        assert words in traced(error), traced(error)
    else:
        assert words in str(error) or re.search(words, str(error)), str(error)


@contextmanager
def rejected(words, kind=InputError):
    """Expect an error whose codes and values contain some words."""
    with pytest.raises(kind) as caught:
        yield caught
    check_message(words, caught.value)
