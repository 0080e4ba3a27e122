"""Notes on the input that do not stop the run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from photogram.lazy_dataclasses import dataclass
from photogram.words import Phrase

__all__ = ["Message", "Undetermined"]

MOST_NAMES = 12  # Maximum number of names in a message

MANY = 2_000  # Number of names above which no nearest name is searched

MOST_CHARACTERS = 200  # Maximum number of characters of a record in a message


def locate(message: str, file: Path | None, record: int | None, text: str | None) -> str:
    """Add the location (file, record number and record text) to a message.

    Long records are shortened. Each unprintable character is replaced by U+FFFD.
    """
    place = ", ".join(
        part for part in (printable(str(file)) if file else "", f"record {record}" if record else "") if part
    )
    head = f"{place}: {message}" if place else message
    if text is None:
        return head
    rest = "" if len(text) <= MOST_CHARACTERS else f"... ({len(text)} characters)"
    return f"{head}\n    |{printable(text[:MOST_CHARACTERS])}{rest}|"


def printable(text: str) -> str:
    """Replace each unprintable character by U+FFFD, to protect terminals."""
    return "".join(character if character.isprintable() else "\ufffd" for character in text)


def unknown_name(kind: str | Phrase, name: str, names: Iterable[str]) -> Phrase:
    """Return the message for an unknown name, with the nearest name or all names."""
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
    fields = {"n": len(missing), "names": list(missing), "columns": list(columns)}
    return Phrase("error.missing-columns", fields)


def counted(count: int, noun: str) -> str:
    """Return a number and its noun in singular or plural: 1 photo, 2 photos."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def coded(messages: Iterable[Message | Phrase | str]) -> list[dict[str, str]]:
    """Return messages as members of JSON documents; a plain sentence has no code."""
    return [{"code": getattr(each, "code", ""), "text": str(each)} for each in messages]


def listed(names: list[str], most: int = MOST_NAMES) -> str:
    """List up to `most` names, followed by the number of the others."""
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


@dataclass(frozen=True)
class Message:
    """Note on the input that does not stop the run.

    Attributes
    ----------
    text
        The note: a sentence, or its code with fields, which is converted to the sentence.
    file, record, record_text
        File, record number in the file (from 1) and text of the record, if they apply.
    phrase
        The note as a code with fields; None for a plain sentence.
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
        """Return the note with this code and fields."""
        return cls(Phrase(code, fields), file)

    @property
    def code(self) -> str:
        """Code of the note; empty for a plain sentence."""
        return "" if self.phrase is None else self.phrase.code

    def __str__(self) -> str:
        return locate(str(self.text), self.file, self.record, self.record_text)


@dataclass(frozen=True)
class Undetermined(Message):
    """Note on unknowns that are undetermined, or nearly so, despite their adjusted values."""

    what: str = ""  # The undetermined unknowns and their meaning
