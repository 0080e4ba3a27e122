"""Exceptions of photogram, all derived from :class:`PhotogramError`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

from photogram.messages import locate
from photogram.words import Phrase, phrase

__all__ = [
    "AdjustmentError",
    "ContradictionError",
    "InputError",
    "OutOfMemoryError",
    "PhotogramError",
    "RankError",
]


class PhotogramError(Exception):
    """Base class of all exceptions that photogram raises; every exception can be pickled.

    Parameters
    ----------
    message
        Error message: a sentence, or its code with fields.

    Attributes
    ----------
    phrase
        The message as a code with fields; None for a plain sentence.
    """

    phrase: Phrase | None = None

    def __init__(self, message: str | Phrase = "", *more: object) -> None:
        super().__init__(str(message), *more)
        if isinstance(message, Phrase):
            self.phrase = message

    @property
    def code(self) -> str:
        """Code of the message in the message catalogue; empty for a plain sentence."""
        return "" if self.phrase is None else self.phrase.code

    def __reduce__(self) -> tuple[Any, ...]:
        # Constructors of subclasses have different arguments.
        return _again, (type(self), self.args, self.__dict__)


def _again(kind: type[PhotogramError], arguments: tuple[Any, ...], held: dict[str, Any]) -> PhotogramError:
    """Rebuild a pickled exception from its arguments and attributes."""
    # BaseException can also create subclasses whose first base is MemoryError.
    error = BaseException.__new__(kind, *arguments)
    error.__dict__.update(held)
    return error


class InputError(PhotogramError, ValueError):
    """Invalid input: a file, a record of a file or an array.

    Parameters
    ----------
    message
        Error message: a sentence, or its code with fields.
    file, record, text
        File, record number in the file (from 1) and text of the record, if they apply.
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
    """Return the message of an error without its location, as a code if it has one."""
    message: str | Phrase = getattr(error, "phrase", None) or getattr(error, "message", "") or str(error)
    return message


class ContradictionError(InputError):
    """Readable input that contradicts itself and would give an unusable result."""

    @classmethod
    def of(cls, error: InputError) -> Self:
        """Convert another input error; message and location are copied."""
        return cls(message_of(error), file=error.file, record=error.record, text=error.text)


class AdjustmentError(PhotogramError):
    """Adjustment that cannot be carried out."""


class OutOfMemoryError(AdjustmentError, MemoryError):
    """Insufficient memory: too little is available, or an allocation failed. The process continues."""


def failure_of_core(kind: str, message: str) -> AdjustmentError:
    """Return the error of a failure of the core that concerns no single object."""
    error = OutOfMemoryError if kind == "memory" else AdjustmentError
    known = kind in ("memory", "empty", "not finite")
    return error(phrase(f"core.{kind}", message=message) if known else message)


class RankError(AdjustmentError):
    """Rank defect: unknowns that the observations do not determine, with their photos and points.

    Parameters
    ----------
    message
        Description of the undetermined unknowns: a sentence, or its code with fields.
    photos, points
        Identifiers of the photos and points concerned.
    cameras
        Names of the cameras concerned.
    what
        Undetermined unknowns in one line. Default: the message.
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
