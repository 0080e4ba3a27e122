"""Remarks on the input that do not stop the run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from photogram.lazy_dataclasses import dataclass
from photogram.words import Phrase

__all__ = ["Message", "Undetermined"]

MOST_NAMES = 12  # Names that a message lists at most

MANY = 2_000  # Names among which no nearest one is looked for

MOST_CHARACTERS = 200  # Characters of a record in a message


def shortened(text: str, most: int = MOST_CHARACTERS) -> str:
    """Return the beginning of a long text, and how long it is; a short one as it is."""
    return text if len(text) <= most else f"{text[:most]}... ({len(text)} characters)"


def locate(message: str, file: Path | None, record: int | None, text: str | None) -> str:
    """Put the place (file, record number, record text) before and after a message.

    Of a long record the beginning is shown. Characters that do not print stand there as U+FFFD, one for one.
    """
    place = ", ".join(
        part for part in (printable(str(file)) if file else "", f"record {record}" if record else "") if part
    )
    head = f"{place}: {message}" if place else message
    if text is None:
        return head
    return f"{head}\n    |{printable(shortened(text))}|"


def printable(text: str) -> str:
    """Return a text with U+FFFD for each character that does not print: no terminal should get it."""
    return "".join(character if character.isprintable() else "\ufffd" for character in text)


def unknown_name(kind: str | Phrase, name: str, names: Iterable[str]) -> Phrase:
    """Return the message that there is no thing with a name: with the nearest name, or all names."""
    import difflib  # a wrong name is rare

    known = list(names)
    if not known or len(known) > MANY:
        return Phrase("error.absent", {"kind": kind, "name": name})
    if close := difflib.get_close_matches(name, known, 1, 0.5):
        return Phrase("error.unknown.close", {"kind": kind, "name": name, "close": close[0]})
    return Phrase("error.unknown", {"kind": kind, "name": name, "names": known})


def by_name(things: Iterable[Any], name: str, kind: str) -> Any:
    """Return the thing with a name; KeyError with the nearest name if there is none."""
    known = {each.name: each for each in things}
    if name not in known:
        raise KeyError(str(unknown_name(kind, name, known)))
    return known[name]


def missing_columns(missing: Sequence[str], columns: Sequence[str]) -> Phrase:
    """Return the message that a table lacks some columns."""
    fields = {"n": len(missing), "names": list(missing), "columns": list(columns)}
    return Phrase("error.missing-columns", fields)


def counted(count: int, noun: str) -> str:
    """Return a number with its noun, which has an s where there are several: 1 photo, 2 photos."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def listed(names: list[str], most: int = MOST_NAMES) -> str:
    """Name all of a few, and some of many: `most` of them."""
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


@dataclass(frozen=True)
class Message:
    """A remark on the input that does not stop the run.

    Attributes
    ----------
    text
        The remark: a sentence, or its code with fields, of which this is the sentence.
    file, record, record_text
        The file, the number of the record in it (from 1) and the record itself, as far as they apply.
    phrase
        The remark as a code with fields; None if it has none.
    """

    text: str | Phrase
    file: Path | None = None
    record: int | None = None
    record_text: str | None = None
    phrase: Phrase | None = None

    def __post_init__(self) -> None:
        if isinstance(self.text, Phrase):
            object.__setattr__(self, "phrase", self.text)
            object.__setattr__(self, "text", str(self.text))

    @classmethod
    def of(cls, code: str, file: Path | None = None, /, **fields: Any) -> Message:
        """Return the remark of a code with its fields."""
        return cls(Phrase(code, fields), file)

    @property
    def code(self) -> str:
        """The code of the remark; empty if it has none."""
        return "" if self.phrase is None else self.phrase.code

    def __str__(self) -> str:
        return locate(str(self.text), self.file, self.record, self.record_text)


@dataclass(frozen=True)
class Undetermined(Message):
    """A remark on unknowns that adjusted values leave undetermined, or so nearly that others fit as well."""

    what: str = ""  # The unknowns, and what that is
