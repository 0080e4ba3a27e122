"""Documents of JSON, YAML and TOML as trees of values with their location."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from photogram.arguments.arrays import value_field
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import unknown_name
from photogram.words import Phrase, phrase


@dataclass(frozen=True)
class Tree:
    """A value of a document and its path.

    Missing members, and values of another type or outside their limits are an :class:`InputError` that
    contains file and path.
    """

    _LARGEST: ClassVar[float] = 1e300

    value: Any
    file: Path
    path: str = ""

    def error(self, message: str | Phrase) -> InputError:
        """Return an error with the location."""
        located = phrase("error.at", what=self.path or phrase("error.document"), message=message)
        return InputError(located, file=self.file, text=repr(self.value)[:120])

    def value_error(self, code: str, **fields: Any) -> InputError:
        return self.error(phrase(code, value=value_field(self.value), **fields))

    def _missing(self, key: str) -> InputError:
        return self.error(phrase("error.missing", name=key))

    def _member(self, key: str, value: Any) -> Self:
        return type(self)(value, self.file, f"{self.path}/{key}")

    def _element(self, number: int, value: Any) -> Self:
        return self._member(str(number), value)

    def _as(self, kind: Any, code: str) -> Any:
        if not isinstance(self.value, kind) or isinstance(self.value, bool):
            raise self.value_error(code)
        return self.value

    def __contains__(self, key: str) -> bool:
        return isinstance(self.value, Mapping) and self.value.get(key) is not None

    def __getitem__(self, key: str) -> Self:
        members = self._as(dict, "error.table")
        if key not in members:
            raise self._missing(key)
        return self._member(key, members[key])

    def at(self, key: str) -> Self:
        """Return a member for errors, also a missing one."""
        return self._member(key, self._as(dict, "error.table").get(key))

    def get(self, key: str, default: Any) -> Self:
        """Return a member; a default, unless it is None, if it is missing or null."""
        missing = self._as(dict, "error.table").get(key) is None
        return self._member(key, default) if missing and default is not None else self[key]

    def table(self, key: str) -> Self:
        """Return a table within this one; an empty one if it is missing."""
        found = self.get(key, {})
        found._as(dict, "error.table")
        return found

    def items(self) -> Iterator[tuple[str, Self]]:
        """Yield the members of an object."""
        for key, value in self._as(dict, "error.table").items():
            yield key, self._member(key, value)

    def __iter__(self) -> Iterator[Self]:
        for number, value in enumerate(self._as(list | tuple, "error.list")):
            yield self._element(number, value)

    def number(self, low: float = -math.inf, high: float = math.inf) -> float:
        """Return a finite number between two limits."""
        value = self._as(int | float, "error.number")
        if not abs(value) <= self._LARGEST:
            raise self.value_error("error.finite")
        if not low <= value <= high:
            code = "error.most" if math.isinf(low) else "error.least" if math.isinf(high) else "error.range"
            raise self.value_error(code, low=low, high=high)
        return float(value)

    def positive(self) -> float:
        """Return a finite positive number."""
        if not (number := self.number()) > 0:
            raise self.value_error("error.positive")
        return number

    def whole(self, lowest: int = 0, highest: int = 2**31 - 1) -> int:
        """Return a whole number between two limits."""
        value = self._as(int | float, "error.number")
        if not lowest <= value <= highest or value != int(value):
            raise self.value_error("error.whole-range", low=lowest, high=highest)
        return int(value)

    def switch(self) -> bool:
        """Return true or false."""
        if not isinstance(self.value, bool):
            raise self.value_error("error.flag")
        return self.value

    def text(self) -> str:
        """Return a text."""
        return str(self._as(str, "toml.text"))

    def choice(self, words: Collection[str]) -> str:
        if not isinstance(self.value, str) or self.value not in words:
            raise self.value_error("error.choice", names=list(words))
        return self.value

    def known(self, what: str, names: Collection[str]) -> str:
        """Return a known word; the error of another one suggests a similar one."""
        if not isinstance(self.value, str) or self.value not in names:
            raise self.error(unknown_name(what, str(self.value), names))
        return self.value

    def word(self) -> str:
        """Return a name or a number of something, which may be written as an integer."""
        return str(self._as(str | int, "error.name"))

    def words(self) -> tuple[str, ...]:
        """Return names as `word` does."""
        return tuple(each.word() for each in self)

    def texts(self) -> tuple[str, ...]:
        """Return a list of strings."""
        if not all(isinstance(each.value, str) for each in self):
            raise self.value_error("toml.texts")
        return tuple(self.value)

    def numbers(self, *counts: int, infinite: bool = False) -> list[float]:
        """Return numbers of an allowed count, by default any.

        A single number needs no brackets. `infinite` permits infinite numbers.
        """
        single = 1 in counts and isinstance(self.value, int | float)
        members = [self] if single else list(self)
        if counts and len(members) not in counts:
            count = counts[0] if len(counts) == 1 else Phrase("toml.or", {"counts": list(counts)})
            raise self.error(phrase("error.count", count=count, actual=len(members)))
        return [math.inf if infinite and each.value == math.inf else each.number() for each in members]

    def named_file(self) -> Path:
        """Return the path of another file, relative to this one."""
        name = self.text()
        if not name or not name.isprintable():
            raise self.value_error("toml.file")
        return self.file.parent / name
