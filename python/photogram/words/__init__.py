"""Messages as codes with fields, and the files of words with their sentences.

A :class:`Phrase` is a code with fields until it is printed. Each language has one file, `en.toml` or
`de.toml`, with a sentence for each code. A field is a name in braces, and may have a form after a colon:

* a number format, such as `{factor:.3g}`;
* a list format: the largest number of parts (`{names:5}`), `;`, `&` (and) or `|` (or) as separator instead of
  commas, and `#` for parts with numbers;
* `^` for an initial capital letter, `+` for `; ` before a text that is not empty;
* `one/several`, the words for one and for other counts or lists: `{n} {n:point/points}`;
* of `cli`, the words for users of Python and for the command line: `{cli:model/--model}`;
* `'` for a quoted text of the input, escaped and shortened. Numbers, lists and phrases are not quoted.

Words before and after a slash may contain fields: `{n:the point {name}/{n} points}`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from numbers import Real
from pathlib import Path
from string import Formatter
from typing import Any

from photogram.lazy_dataclasses import dataclass, field

MAX_NAMES = 12  # Largest number of names in a list

MAX_QUOTED = 40  # Largest number of characters of a field that a message quotes

_on_command_line: ContextVar[bool] = ContextVar("on_command_line", default=False)
CHOICE = re.compile(r"\{(\w+):((?:[^{}/]|\{[^{}]*\})*)/((?:[^{}]|\{[^{}]*\})*)\}")
_SENTENCE = re.compile(r'^("\S.*?") = (".*")$', re.MULTILINE)


@dataclass(frozen=True, repr=False)
class Phrase:
    """A message, or a name in one: a code with fields, printed in English.

    Attributes
    ----------
    code
        Key of its sentence in the files of words, such as `verdict.gross-errors.likely`.
    fields
        Numbers, texts, phrases, and lists of these, by name.
    """

    code: str
    fields: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        return words_of("en").text(self)

    def __repr__(self) -> str:
        return f"<{self.code}: {self}>"

    def __format__(self, form: str) -> str:
        return format(str(self), form)

    def __hash__(self) -> int:
        return hash(self.code)

    def document(self) -> dict[str, Any]:
        """Return code, fields and sentence in the form of JSON documents."""
        return {"code": self.code, "fields": self.fields, "text": str(self)}


def quoted(text: str) -> str:
    """Return a quoted field of the input, escaped and shortened."""
    rest = "" if len(text) <= MAX_QUOTED else f"... ({len(text)} characters)"
    return f"{text[:MAX_QUOTED]!r}{rest}"


def phrase(code: str, /, **fields: Any) -> Phrase:
    """Return the message of a code with its fields."""
    return Phrase(code, fields)


def option_sd(kind: str) -> Phrase:
    """Return the option for standard deviations of a type of data."""
    return Phrase("option.sd", {"kind": kind})


OPTIONS_OF_CONTROL = (Phrase("option.control"), Phrase("option.datum"))  # Options that add control


@contextmanager
def on_command_line() -> Iterator[None]:
    """Use words that name command-line options instead of functions of Python."""
    token = _on_command_line.set(True)
    try:
        yield
    finally:
        _on_command_line.reset(token)


@cache
def table_of(language: str) -> Mapping[str, str]:
    """Return the sentences of a language by code."""
    import json  # Imported with the first sentence

    source = Path(__file__).with_name(f"{language}.toml").read_text(encoding="utf-8")
    # tomllib takes four times as long.
    return {
        code[1:-1]: json.loads(sentence) if "\\" in sentence else sentence[1:-1]
        for code, sentence in _SENTENCE.findall(source)
    }


@cache
def words_of(language: str) -> Words:
    return Words(language)


def _chosen(sentence: str, fields: Mapping[str, Any]) -> str:
    """Return a sentence with the words for its reader and its counts."""

    def words(found: re.Match[str]) -> str:
        value = fields.get(found[1])
        count = len(value) if isinstance(value, list | tuple) else value
        first = not _on_command_line.get() if found[1] == "cli" else count == 1
        return _chosen(found[2 if first else 3], fields)

    return CHOICE.sub(words, sentence)


@cache
def _parts(sentence: str) -> list[tuple[str, str | None, str]]:
    """Return the texts of a sentence, each with the following field and its form."""
    return [(text, name, form or "") for text, name, form, _ in Formatter().parse(sentence)]


class Words:
    """Sentences in a language, with its number format.

    Parameters
    ----------
    language
        `en` or `de`; codes without a sentence in it are in English.
    own
        Sentences by code that replace the sentences of the language.
    """

    def __init__(self, language: str = "en", own: Mapping[str, str] | None = None) -> None:
        self.language = language
        self._table = {**table_of("en"), **table_of(language), **(own or {})}

    def __call__(self, code: str, **fields: Any) -> str:
        """Return the sentence of a code with its fields."""
        return self._composed(code, fields)

    def text(self, value: Any, form: str = "") -> str:
        """Return a phrase, a list, a number or a text in the language."""
        if isinstance(value, Phrase):
            text = self._composed(value.code, value.fields)
        elif isinstance(value, list | tuple):
            text = self._list(value, form)
        elif isinstance(value, Real):
            return self._number(value, form.replace("'", ""))
        else:
            text = str(value)
        if "'" in form and isinstance(value, str):
            return quoted(text)
        text = f"{text[:1].upper()}{text[1:]}" if "^" in form else text
        return f"; {text}" if text and "+" in form else text

    def has(self, code: str) -> bool:
        """Return whether there is a sentence."""
        return code in self._table

    def below(self, group: str, **fields: Any) -> dict[str, str]:
        """Return the sentences whose codes begin with a group, by the rest of their codes."""
        codes = [code for code in self._table if code.startswith(group)]
        return {code.removeprefix(group): self(code, **fields) for code in codes}

    def listed(self, names: Sequence[str], most: int = MAX_NAMES) -> str:
        """List all names, or the first `most` of them."""
        shown = ", ".join(names[:most])
        return shown if len(names) <= most else self("word.more", names=shown, count=len(names) - most)

    def numeral(self, written: str) -> str:
        """Convert a number with a decimal point to the format of the language."""
        return written.replace(".", self._table["number.decimal"])

    def _composed(self, code: str, fields: Mapping[str, Any]) -> str:
        sentence = self._table.get(code)
        if sentence is None:  # Names of user-defined types of observations, units and components
            return code.partition(".")[2] or code
        return "".join(
            text if name is None else text + self.text(fields.get(name, ""), form)
            for text, name, form in _parts(_chosen(sentence, fields))
        )

    def _list(self, values: Sequence[Any], form: str) -> str:
        parts = [self.text(each) for each in values]
        if "#" in form:
            parts = [f"{number}) {each}" for number, each in enumerate(parts, 1)]
        for sign, between in ((";", "; "), ("&", self._table["word.and"]), ("|", self._table["word.or"])):
            if sign in form:
                return between.join(parts)
        most = "".join(filter(str.isdigit, form))
        return self.listed(parts, int(most) if most else MAX_NAMES)

    def _number(self, value: Any, form: str) -> str:
        return self.numeral(format(value, form))
