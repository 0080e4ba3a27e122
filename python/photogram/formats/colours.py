"""Colours of points by their names, looked up when somebody asks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from photogram.arguments.types import Indices

__all__ = ["Colours"]


class Colours(Mapping[str, Sequence[int]]):
    """Red, green and blue of points.

    Parameters
    ----------
    names
        Of the points.
    values
        (n, 3) from 0 to 255.
    """

    def __init__(self, names: Sequence[str], values: Indices) -> None:
        self._names, self._values = names, values

    @cached_property
    def _found(self) -> dict[str, list[int]]:
        return dict(zip(self._names, self._values.tolist(), strict=True))

    def __getitem__(self, name: str) -> Sequence[int]:
        return self._found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)
