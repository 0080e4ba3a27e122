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
