"""The words of a statement: a table of sentences for each language, and a firm's own in their place."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from datetime import date
from functools import cache
from importlib.resources import files
from string import Formatter
from typing import Any

from photogram.errors import InputError
from photogram.messages import MOST_NAMES, nearest
from photogram.show.page import fixed, probability_written

LANGUAGES = ("en", "de")
NOTHING = "–"
"""What stands for a number that there is not."""


@cache
def table_of(language: str) -> Mapping[str, str]:
    """Return the table of a language: sentences, and words of other modules, by key."""
    found: dict[str, str] = {}
    for name in (f"{language}.toml", f"{language}.words.toml"):
        source = files("photogram.results.statement").joinpath("text", name)
        found |= tomllib.loads(source.read_text(encoding="utf-8"))
    return found


def fields_of(sentence: str) -> set[str]:
    """Return the names of the fields of a sentence; refuse braces with more than a name, or not closed."""
    try:
        parts = list(Formatter().parse(sentence))
    except ValueError as error:
        raise InputError(f"{sentence!r}: {error}") from None
    if any(form or conversion for _, name, form, conversion in parts if name is not None):
        raise InputError(f"{sentence!r}: a field is a name in braces, such as {{n}}")
    return {name for _, name, _, _ in parts if name is not None}


_Parts = Sequence[tuple[str, str | None]]


@cache
def _patterns(family: str) -> list[tuple[str, _Parts]]:
    """Return the English sentences of a family by key, as texts with fields, in the order of the table."""
    return [
        (key, [(text, name) for text, name, *_ in Formatter().parse(sentence)])
        for key, sentence in table_of("en").items()
        if key.startswith(f"{family}.")
    ]


def _ways(parts: _Parts, said: str) -> Iterator[dict[str, str]]:
    """Yield the fields of a sentence for every division of a text, those with a long first field first."""
    if not parts:
        if not said:
            yield {}
        return
    (text, name), rest = parts[0], parts[1:]
    if not said.startswith(text):
        return
    said = said[len(text) :]
    if name is None:
        yield from _ways(rest, said)
        return
    for end in range(len(said), 0, -1):
        for fields in _ways(rest, said[end:]):
            yield {name: said[:end], **fields}


class Texts:
    """Sentences in a language, with numbers as the language writes them.

    Parameters
    ----------
    language
        `en`, `de`.
    own
        Sentences by key that stand for those of the language.
    unit
        The linear unit of the block.
    names
        Names of points, photos, cameras and unknowns by the field that contains them: texts of other modules
        are divided at these names only. A field without names contains any text.

    Raises
    ------
    InputError
        A language or a key that there is not, fields that a sentence does not have.
    """

    def __init__(
        self,
        language: str = "en",
        own: Mapping[str, str] | None = None,
        unit: str = "m",
        names: Mapping[str, Collection[str]] | None = None,
    ) -> None:
        if language not in LANGUAGES:
            raise InputError(f"there is no language {language!r}: {', '.join(LANGUAGES)}")
        self.language, self.unit, self._names = language, unit, names or {}
        english = table_of("en")
        for key, sentence in (own or {}).items():
            if key not in english:
                raise InputError(f"there is no sentence {key!r}{nearest(key, english)}")
            if not isinstance(sentence, str):
                raise InputError(f"{key} is no sentence: {sentence!r}")
            if strange := fields_of(sentence) - fields_of(english[key]):
                raise InputError(f"{key} has no field {sorted(strange)[0]!r}")
        local = table_of(language)
        self.missing = sorted(set(english) - set(local))
        """Keys that are said in English for want of a sentence in the language."""
        self._table, self._own = {**english, **local, **(own or {})}, own or {}

    def __call__(self, key: str, **values: Any) -> str:
        """Return a sentence with its fields, in the singular where one of them is a count of one."""
        sentence = self._table[self._form(key, values)]
        return sentence.format(**{name: self._field(value) for name, value in values.items()})

    def said(self, key: str, **values: Any) -> tuple[str, str]:
        """Return a key with its sentence."""
        return key, self(key, **values)

    def _form(self, key: str, values: Mapping[str, Any]) -> str:
        """Return the key of the sentence in the form that its counts take."""
        ones = [name for name, value in values.items() if isinstance(value, int) and value == 1]
        # One of what a sentence counts first leaves no other count in it.
        for name in sorted(ones, key=lambda name: name != "n"):
            form = f"{key}.one" if name == "n" else f"{key}.one.{name}"
            # A firm that has put a sentence of its own means it for every count.
            if form in self._own or (form in self._table and key not in self._own):
                return form
        return key

    def _field(self, value: Any) -> str:
        if isinstance(value, str):
            return value
        if isinstance(value, int):
            return self.number(float(value), 0)
        return self.significant(value)

    def number(self, value: float, decimals: int) -> str:
        """Return a number with so many decimals."""
        if not math.isfinite(value):
            return NOTHING if math.isnan(value) else "∞" if value > 0 else "-∞"
        return self.numeral(fixed(value, decimals))

    def significant(self, value: float, figures: int = 3) -> str:
        """Return a number with so many significant figures, at least."""
        if not math.isfinite(value) or value == 0:
            return self.number(value, 0)
        return self.number(value, max(0, figures - 1 - math.floor(math.log10(abs(value)))))

    def probability(self, value: float) -> str:
        """Return a probability."""
        return probability_written(value).replace(".", self._table["number.decimal"])

    def numeral(self, written: str) -> str:
        """Return a number that is written with a point as the language writes it."""
        sign = written[:1] if written[:1] in "-+" else ""
        whole, point, decimals = written.removeprefix(sign).partition(".")
        group = self._table["number.group"]
        head = ""
        while len(whole) > 4 or (head and len(whole) > 3):
            whole, head = whole[:-3], group + whole[-3:] + head
        return sign.replace("-", "−") + whole + head + (point and self._table["number.decimal"]) + decimals

    def length(self, value: float, figures: int = 2) -> str:
        """Return a length with its unit: centimetres where it is less than a metre, millimetres for less."""
        unit, factor = self.small(value)
        return f"{self.significant(value * factor, figures)} {unit}"

    def size(self, value: float) -> str:
        """Return a class as it was asked for: `5 cm`."""
        unit, factor = self.small(value)
        return f"{self.numeral(f'{value * factor:.6g}')} {unit}"

    def small(self, value: float) -> tuple[str, float]:
        """Return the unit in which people read a length of this size, and what leads to it."""
        if self.unit != "m" or not math.isfinite(value):
            return self.unit, 1.0
        size = abs(value)
        return ("m", 1.0) if size >= 1 else ("cm", 100.0) if size >= 0.01 else ("mm", 1000.0)

    def percent(self, probability: float) -> str:
        """Return a probability in percent, without its sign."""
        percent = 100 * probability
        if not math.isfinite(percent):
            return NOTHING
        return self.numeral(f"{percent:.1f}".removesuffix(".0"))

    def day(self, given: str) -> str:
        """Return a date (ISO) as the language writes it; anything else as it is."""
        try:
            day = date.fromisoformat(given)
        except ValueError:
            return given
        return self._table["date"].format(year=day.year, month=f"{day.month:02}", day=f"{day.day:02}")

    def has(self, key: str) -> bool:
        """Return whether there is a sentence."""
        return key in self._table

    def word(self, family: str, name: str) -> str:
        """Return what a word of another module is called in the language; one without a key as it is."""
        key = f"{family}.{name}"
        return self(key) if key in self._table else name

    def listed(self, names: Sequence[str], most: int = MOST_NAMES) -> str:
        """Name all of a few, and some of many."""
        shown = ", ".join(names[:most])
        return shown if len(names) <= most else self("word.more", names=shown, count=len(names) - most)

    def is_name(self, text: str) -> bool:
        """Return whether a text is the name of a point, photo, camera or unknown."""
        return any(text in names for names in self._names.values())

    def recognised(
        self, family: str, said: str, accepts: Callable[[Mapping[str, str]], bool] = bool
    ) -> tuple[str, dict[str, str]] | None:
        """Return the key of a family whose English sentence this is, and its fields; None without one.

        `accepts` judges fields; names are those of the block.
        """
        for key, parts in _patterns(family):
            for fields in _ways(parts, said):
                known = (value in self._names.get(name, (value,)) for name, value in fields.items())
                if all(known) and (not fields or accepts(fields)):
                    return key, fields
        return None
