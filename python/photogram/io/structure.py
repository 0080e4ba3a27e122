"""Lossless conversion of dataclass objects to JSON values, and back.

Unlike pickle, such a document runs no code. It contains names of classes, which must be in a list of the
reader, and their fields. Shared objects remain shared. Numbers outside JSON (NaN, infinite), arrays, tuples
and tables of names are marked: `{"array": ...}`, `{"tuple": ...}`, `{"map": ...}`.
"""

from __future__ import annotations

import math
from base64 import b64decode, b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.fields import check_members
from photogram.errors import InputError
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import fields
from photogram.words import phrase

SMALL = 36  # Largest size of an array that is written as readable numbers
_NUMBERS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


class Encoder:
    """Converter to plain values of one document."""

    def __init__(self) -> None:
        self._written: dict[int, tuple[int, object]] = {}

    def value(self, given: Any) -> Any:
        """Convert a value to JSON."""
        if given is None or isinstance(given, bool | str):
            return given
        if isinstance(given, int | np.integer):
            return int(given)
        if isinstance(given, float | np.floating):
            number = float(given)
            return number if math.isfinite(number) else {"number": str(number)}
        if isinstance(given, np.ndarray):
            return self._array(given)
        if isinstance(given, list):
            return [self.value(each) for each in given]
        if isinstance(given, Sequence):
            return {"tuple": [self.value(each) for each in given]}
        if isinstance(given, Mapping):
            return {"map": [[self.value(name), self.value(each)] for name, each in given.items()]}
        if isinstance(given, Path):
            return {"path": str(given)}
        if is_dataclass(given) and not isinstance(given, type):
            return self._object(given)
        raise TypeError(f"a document cannot contain {type(given).__name__}")

    def fields(self, given: Any, omitted: Iterable[str] = ()) -> dict[str, Any]:
        """Return the stored fields of a dataclass object by name, except omitted ones.

        The metadata `stored` of a computed field is the method that returns the object with its value.
        """
        left = set(omitted)
        return {
            each.name: self.value(getattr(given, each.name))
            for each in fields(given)
            if (each.init or "stored" in each.metadata) and each.name not in left
        }

    def _object(self, given: Any) -> dict[str, Any]:
        if id(given) in self._written:
            return {"same": self._written[id(given)][0]}
        own = {"is": type(given).__name__, **self.fields(given)}
        # No other object has its id during its lifetime
        self._written[id(given)] = len(self._written), given
        return own

    def _array(self, given: np.ndarray) -> dict[str, Any]:
        if given.dtype.kind == "f" and given.size <= SMALL and np.isfinite(given).all():
            return {"array": given.tolist()}
        plain = np.ascontiguousarray(given, dtype=given.dtype.newbyteorder("<"))
        return {
            "array": b64encode(plain.tobytes()).decode("ascii"),
            "type": plain.dtype.str,
            "shape": list(given.shape),
        }


class Decoder:
    """Converter of :class:`Encoder` output to objects of the given classes only."""

    def __init__(self, classes: Iterable[type], path: Path) -> None:
        self._classes = {each.__name__: each for each in classes}
        self._path = path
        self._made: list[object] = []
        self._kinds: dict[str, Callable[[Any], Any]] = {
            "tuple": lambda given: tuple(self.value(each) for each in given["tuple"]),
            "map": lambda given: {self.value(name): self.value(each) for name, each in given["map"]},
            "number": lambda given: _NUMBERS[given["number"]],
            "path": lambda given: Path(given["path"]),
            "array": self._array,
            "same": lambda given: self._made[given["same"]],
            "is": self._object,
        }

    def value(self, given: Any) -> Any:
        """Convert a JSON value to an object."""
        if isinstance(given, list):
            return [self.value(each) for each in given]
        if not isinstance(given, dict):
            return given
        kind = next(iter(given), "")  # The first key is the mark: members may have names of marks
        if kind not in self._kinds:
            raise self._error("document.kind", value=str(given))
        try:
            return self._kinds[kind](given)
        except (LookupError, TypeError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise self._error("document.value", value=str(given), kind=kind, reason=str(error)) from None

    def fields(self, given: Any, kind: type = object) -> dict[str, Any]:
        """Return the separately written fields of an object of a class."""
        if not isinstance(given, dict):
            raise self._error("error.table", value=str(given))
        members = {name: self.value(value) for name, value in given.items()}
        with at_place(Place(self._path)):
            check_members(kind, members)
        return members

    def _object(self, given: dict[str, Any]) -> object:
        name = given["is"]
        if name not in self._classes:
            raise self._error("document.class", name=str(name))
        kind = self._classes[name]
        own = self.fields({member: each for member, each in given.items() if member != "is"}, kind)
        with at_place(Place(self._path)):
            stored = {
                each.metadata["stored"]: each.name for each in fields(kind) if "stored" in each.metadata
            }
            computed = {method: own.pop(name) for method, name in stored.items()}
            made = kind(**own)
            for method, value in computed.items():
                made = getattr(made, method)(value)
        self._made.append(made)
        return made

    def _array(self, given: dict[str, Any]) -> np.ndarray:
        if "type" not in given:
            return np.array(given["array"], dtype=float)
        kind = np.dtype(given["type"])
        if kind.hasobject:
            raise ValueError("an array of objects")
        found = np.frombuffer(b64decode(given["array"], validate=True), dtype=kind)
        return found.reshape(given["shape"]).astype(kind.newbyteorder("="))

    def _error(self, code: str, **fields: Any) -> InputError:
        return InputError(phrase(code, **fields), file=self._path)
