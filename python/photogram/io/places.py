"""Locations in files, for errors and remarks."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from photogram.errors import InputError, message_of
from photogram.io.numbers import LARGEST_INTEGER, finite_number, whole_number
from photogram.messages import Message
from photogram.words import Phrase, phrase


class Failing(Protocol):
    """An object with a location: a place, XML element or JSON member."""

    def error(self, message: str | Phrase, /) -> InputError:
        """Return an error with the location."""


@contextmanager
def at_place(place: Failing, what: str | Phrase = "") -> Iterator[None]:
    """Add a location, and the name of the invalid item, to errors without a file."""
    try:
        yield
    except InputError as error:
        if error.file:
            raise
        message = message_of(error)
        raise place.error(phrase("error.at", what=what, message=message) if what else message) from None


def positive(place: Failing, name: str, value: float) -> float:
    """Return a number of a file; reject a number that is not positive."""
    if not value > 0:
        raise place.error(phrase("format.positive", name=name, value=value))
    return value


def one_word(place: Failing, what: str, value: str, names: Collection[str]) -> str:
    """Return a word of a file; reject a word that is not one of some names."""
    if value not in names:
        raise place.error(phrase("format.unknown", what=what, value=value, names=list(names)))
    return value


def image_size(place: Failing, width: float, height: float) -> tuple[int, int]:
    """Return width and height of images of a file; reject sizes that are not whole and positive."""
    if not all(0 < side < 2**31 and side == int(side) for side in (width, height)):
        raise place.error(phrase("format.size", width=width, height=height))
    return int(width), int(height)


@dataclass(frozen=True, slots=True)
class Place:
    """Location of data: file, record number (from 1) and record, if known."""

    file: Path | None = None
    record: int | None = None
    text: str | None = None

    def error(self, message: str | Phrase) -> InputError:
        """Return an error with the location."""
        return InputError(message, file=self.file, record=self.record, text=self.text)

    def number(self, text: str, what: str | Phrase = "") -> float:
        """Read a finite number; errors contain the location and its name."""
        with at_place(self, what):
            return finite_number(text)

    def whole(self, text: str, what: str | Phrase = "", highest: int = LARGEST_INTEGER) -> int:
        """Read an integer that is not negative; errors as :meth:`number`."""
        with at_place(self, what):
            return whole_number(text, highest=highest)

    def message(self, message: str | Phrase) -> Message:
        """Return a remark with the location."""
        return Message(message, self.file, self.record, self.text)
