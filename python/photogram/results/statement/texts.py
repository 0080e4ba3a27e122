"""Texts of a statement: sentences and numbers in a language, and user sentences."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from string import Formatter
from typing import Any

from photogram.arguments.arrays import argument_error, one_of
from photogram.errors import InputError
from photogram.messages import unknown_name
from photogram.show.page import fixed, probability_written
from photogram.words import CHOICE, Words, phrase, table_of

LANGUAGES = ("en", "de")
NOTHING = "–"  # Missing number


def fields_of(sentence: str) -> set[str]:
    """Return the names of the fields of a sentence; refuse braces that are not closed."""
    return {name for name, _ in _forms_of(sentence)} - {"cli"}


def _forms_of(sentence: str) -> list[tuple[str, str]]:
    """Return the fields with their forms, and the counts that choose words."""
    words = sentence
    while CHOICE.search(words):
        words = CHOICE.sub(r"{\1}\2\3", words)
    try:
        parts = list(Formatter().parse(words))
    except ValueError as error:
        raise InputError(phrase("request.braces", sentence=sentence, reason=str(error))) from None
    return [(name, form or conversion or "") for _, name, form, conversion in parts if name is not None]


class Texts(Words):
    """Sentences and numbers in a language, for a linear unit; `own` replace sentences by code."""

    def __init__(self, language: str = "en", own: Mapping[str, str] | None = None, unit: str = "m") -> None:
        one_of("language", language, LANGUAGES)
        self.language, self.unit = language, unit
        english = table_of("en")
        for key, sentence in (own or {}).items():
            if key not in english:
                alike = [code for code in english if code.partition(".")[0] == key.partition(".")[0]]
                absent = phrase("error.absent", kind="code", name=key)
                raise InputError(unknown_name("code", key, alike) if alike else absent)
            if not isinstance(sentence, str):
                raise argument_error(key, "text", value=sentence)
            known = fields_of(english[key])
            if strange := fields_of(sentence) - known:
                fields = {"field": sorted(strange)[0], "names": sorted(known)}
                raise InputError(phrase("request.field", code=key, **fields))
            if any(form for _, form in _forms_of(sentence)):
                raise InputError(phrase("request.form", code=key, value=sentence))
        super().__init__(language, own)
        own = table_of(language)
        families = {key.partition(".")[0] for key in own}  # Other families do not belong to statements
        self.missing = sorted(key for key in set(english) - set(own) if key.partition(".")[0] in families)
        """Keys that use English because the language has no sentence."""

    def __call__(self, code: str, **fields: Any) -> str:
        """Return the sentence of a code; numbers have the forms of :data:`FORMS`."""
        for name, value in fields.items():
            if isinstance(value, float) and name in FORMS:
                fields[name] = FORMS[name](self, value)
        return super().__call__(code, **fields)

    def _number(self, value: float, form: str) -> str:
        if form:
            return self.numeral(format(value, form))
        return self.number(float(value), 0) if isinstance(value, int) else self.significant(value)

    def number(self, value: float, decimals: int) -> str:
        if not math.isfinite(value):
            return NOTHING if math.isnan(value) else "∞" if value > 0 else "-∞"
        return self.numeral(fixed(value, decimals))

    def significant(self, value: float, figures: int = 3) -> str:
        if not math.isfinite(value) or value == 0:
            return self.number(value, 0)
        return self.number(value, max(0, figures - 1 - math.floor(math.log10(abs(value)))))

    def probability(self, value: float) -> str:
        return self.numeral(probability_written(value))

    def numeral(self, written: str) -> str:
        """Return a number in the notation of the language."""
        sign = written[:1] if written[:1] in "-+" else ""
        whole, point, decimals = written.removeprefix(sign).partition(".")
        group = self._table["number.group"]
        head = ""
        while whole.isdigit() and (len(whole) > 4 or (head and len(whole) > 3)):
            whole, head = whole[:-3], group + whole[-3:] + head
        return sign.replace("-", "−") + whole + head + (point and self._table["number.decimal"]) + decimals

    def length(self, value: float, figures: int = 2) -> str:
        """Return a length with unit: metres, centimetres or millimetres by size."""
        unit, factor = self.small(value)
        return f"{self.significant(value * factor, figures)} {unit}"

    def size(self, value: float) -> str:
        """Return a class as in the request: `5 cm`."""
        unit, factor = self.small(value)
        return f"{self.numeral(f'{value * factor:.6g}')} {unit}"

    def small(self, value: float) -> tuple[str, float]:
        """Return the display unit of a length of this size, and its factor."""
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
        """Return a date (ISO) in the notation of the language; other texts are unchanged."""
        try:
            day = date.fromisoformat(given)
        except ValueError:
            return given
        return self._table["date"].format(year=day.year, month=f"{day.month:02}", day=f"{day.day:02}")

    def kind(self, name: str) -> str:
        """Return the plural of a type: `images`, `prior, lever arm`, ..."""
        names = []
        for part in name.split(", "):
            count, blank, rest = part.partition(" ")
            counted = f"{count} {self(f'kind.{rest}')}" if blank and count.isdigit() else ""
            names.append(counted or self(f"kind.{part}"))
        return ", ".join(names)

    def observation(self, parts: Sequence[str]) -> str:
        """Return the name of an observation from type, items, and component."""
        kind, *things, component = parts
        one = ", ".join(self(f"kind.{part}", n=1) for part in kind.split(", "))
        return " ".join([one, *things, self(f"axis.{component}")])


FORMS: dict[str, Callable[[Texts, float], str]] = {
    **dict.fromkeys(("rmse", "rmse_h", "rmse_v", "rmse_3d", "loo_h", "loo_v"), Texts.length),
    **dict.fromkeys(("accuracy_r", "accuracy_z", "ce95", "largest", "rms", "mean", "expanded"), Texts.length),
    **dict.fromkeys(("sd", "shift", "rise", "bend", "survey", "value", "east", "north"), Texts.length),
    **dict.fromkeys(("height", "limit"), Texts.length),
    **dict.fromkeys(("share", "percent", "spacing"), Texts.percent),
    **dict.fromkeys(("factor", "low", "high", "k", "ratio"), lambda texts, value: texts.number(value, 2)),
    "p": Texts.probability,
    "class": Texts.size,
}
"""Forms of numbers in sentences by the names of fields."""
