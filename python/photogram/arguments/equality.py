"""Equality of dataclasses that contain arrays, by value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import ClassVar

import numpy as np


class Valued:
    """A dataclass that compares all fields by value; NaN equals NaN.

    Declare it with `eq=False`, which leaves `==` to this class. The hash uses names and types only.
    """

    _BESIDE: ClassVar[frozenset[str]] = frozenset()
    """Fields that are not compared: computing time and method."""

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(other) is not type(self):
            return NotImplemented
        return all(alike(getattr(self, name), getattr(other, name)) for name in self._compared())

    def __hash__(self) -> int:
        values = (getattr(self, name) for name in self._compared())
        return hash((type(self).__name__, *(each for each in values if isinstance(each, str | bool | None))))

    def _set(self, name: str, value: object) -> None:
        """Set a field of a frozen dataclass, in its `__post_init__`."""
        object.__setattr__(self, name, value)

    def _compared(self) -> list[str]:
        return [each.name for each in fields(self) if each.name not in self._BESIDE]  # type: ignore[arg-type]


def alike(a: object, b: object) -> bool:
    """Return whether two values have one type and equal contents."""
    if a is b:
        return True
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        one, other = np.asarray(a), np.asarray(b)
        alike_kinds = one.shape == other.shape and one.dtype.kind == other.dtype.kind
        return alike_kinds and np.array_equal(one, other, equal_nan=one.dtype.kind in "fc")
    if type(a) is not type(b):
        return False
    if isinstance(a, Valued):
        return a == b
    if is_dataclass(a) and not isinstance(a, type):
        return all(alike(getattr(a, each.name), getattr(b, each.name)) for each in fields(a))
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(alike(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        strings = all(type(each) is str for each in a)  # May be many strings
        return len(a) == len(b) and (a == b if strings else all(map(alike, a, b)))
    return bool(a == b) or (isinstance(a, float) and a != a and b != b)
