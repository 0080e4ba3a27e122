"""What goes wrong: a small tree of exceptions under :class:`PhotogramError`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

from photogram.messages import locate
from photogram.words import Phrase

__all__ = [
    "AdjustmentError",
    "ContradictionError",
    "InputError",
    "OutOfMemoryError",
    "PhotogramError",
    "RankError",
]


class PhotogramError(Exception):
    """Base of every exception that photogram raises on purpose; all can be pickled.

    Parameters
    ----------
    message
        What is wrong: a sentence, or its code with fields.

    Attributes
    ----------
    phrase
        The message as a code with fields; None if it has none.
    """

    phrase: Phrase | None = None

    def __init__(self, message: str | Phrase = "", *more: object) -> None:
        super().__init__(str(message), *more)
        if isinstance(message, Phrase):
            self.phrase = message

    @property
    def code(self) -> str:
        """The code of the message in the files of words; empty if it has none."""
        return "" if self.phrase is None else self.phrase.code

    def __reduce__(self) -> tuple[Any, ...]:
        # Not by what the class is called with, which differs from one to the other.
        return _again, (type(self), self.args, self.__dict__)


def _again(kind: type[PhotogramError], arguments: tuple[Any, ...], held: dict[str, Any]) -> PhotogramError:
    """Make an exception anew of what it holds."""
    # Of a MemoryError that is an error of ours first, too, the base makes the object.
    error = BaseException.__new__(kind, *arguments)
    error.__dict__.update(held)
    return error


class InputError(PhotogramError, ValueError):
    """Input that cannot be used: a file, a record of it, or an array.

    Parameters
    ----------
    message
        What is wrong: a sentence, or its code with fields.
    file, record, text
        The file, the number of the record in it (from 1) and the record itself, as far as they apply.
    """

    def __init__(
        self,
        message: str | Phrase,
        *,
        file: Path | None = None,
        record: int | None = None,
        text: str | None = None,
    ) -> None:
        super().__init__(message)
        self.message = str(message)
        self.args = (locate(self.message, file, record, text),)
        self.file = file
        self.record = record
        self.text = text


def message_of(error: Exception) -> str | Phrase:
    """Return the message of an error without its place, as a code with fields if it has one."""
    message: str | Phrase = getattr(error, "phrase", None) or getattr(error, "message", "") or str(error)
    return message


class ContradictionError(InputError):
    """Input that can be read and contradicts itself: what would be made of it could not be used."""

    @classmethod
    def of(cls, error: InputError) -> Self:
        """Return it at the place of another error, with its message."""
        return cls(message_of(error), file=error.file, record=error.record, text=error.text)


class AdjustmentError(PhotogramError):
    """The adjustment could not be carried out."""


class OutOfMemoryError(AdjustmentError, MemoryError):
    """The work would take more memory than there is, or an allocation has failed. The process goes on."""


class RankError(AdjustmentError):
    """The observations do not determine all unknowns; the message names the photos and points concerned.

    Parameters
    ----------
    message
        What is undetermined: a sentence, or its code with fields.
    photos, points
        Identifiers of the photos and points concerned.
    cameras
        Names of the cameras concerned.
    what
        What is undetermined, in one line; nothing where it is the message.
    """

    def __init__(
        self,
        message: str | Phrase,
        photos: list[str],
        points: list[str],
        cameras: list[str] | None = None,
        what: str = "",
    ) -> None:
        super().__init__(message)
        self.photos = photos
        self.points = points
        self.cameras = cameras or []
        self.what = what or str(message)
