"""Places in files, so that errors and remarks can name them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from photogram.errors import InputError, message_of
from photogram.io.numbers import LARGEST_INTEGER, finite_number, whole_number
from photogram.messages import Message
from photogram.words import Phrase, phrase


class Failing(Protocol):
    """What can tell where it stands in a file: a place, an element of XML, a member of JSON."""

    def error(self, message: str | Phrase, /) -> InputError:
        """Return an error that names the place."""


@contextmanager
def at_place(place: Failing, what: str | Phrase = "") -> Iterator[None]:
    """Let errors name a place, and the faulty thing, if they name no file yet."""
    try:
        yield
    except InputError as error:
        if error.file:
            raise
        message = message_of(error)
        raise place.error(phrase("error.at", what=what, message=message) if what else message) from None


@dataclass(frozen=True, slots=True)
class Place:
    """Where something was read: file, record number (from 1) and record, as far as they are known."""

    file: Path | None = None
    record: int | None = None
    text: str | None = None

    def error(self, message: str | Phrase) -> InputError:
        """Return an error that names the place."""
        return InputError(message, file=self.file, record=self.record, text=self.text)

    def number(self, text: str, what: str | Phrase = "") -> float:
        """Return a finite number that a text is; an error names the place, and what it should be."""
        with at_place(self, what):
            return finite_number(text)

    def whole(self, text: str, what: str | Phrase = "", highest: int = LARGEST_INTEGER) -> int:
        """Return a whole number that is not negative; errors as :meth:`number`."""
        with at_place(self, what):
            return whole_number(text, highest=highest)

    def message(self, message: str | Phrase) -> Message:
        """Return a remark that names the place."""
        return Message(message, self.file, self.record, self.text)
