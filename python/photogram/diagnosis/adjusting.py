"""Adjustments of a check: each block once."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.errors import AdjustmentError
from photogram.network.block import Block
from photogram.results.result import Result

__all__ = ["Adjuster"]

KEPT = 2
"""Adjustments that are remembered."""


class Adjuster:
    """Adjusts blocks with the same options, and remembers the last ones."""

    def __init__(self, options: dict[str, Any]) -> None:
        self.options = options
        self._known: list[tuple[Block, Result | AdjustmentError]] = []

    def __call__(self, block: Block) -> Result:
        """Adjust a block; what it raises is raised again for the same block."""
        found = next((result for known, result in self._known if _same(known, block)), None)
        if found is None:
            try:
                found = adjust(block, **self.options)
            except AdjustmentError as error:
                found = error
            self._known = [*self._known[1 - KEPT :], (block, found)]
        if isinstance(found, AdjustmentError):
            raise found
        return found

    def tried(self, block: Block) -> Result | None:
        """Adjust a block; None where that cannot be done."""
        try:
            return self(block)
        except AdjustmentError:
            return None

    def otherwise(self, **options: Any) -> Adjuster:
        """Return one with other options."""
        return Adjuster({**self.options, **options})


def _same(one: Block, other: Block) -> bool:
    return one is other or all(
        _equal(getattr(one, each.name), getattr(other, each.name)) for each in fields(one)
    )


def _equal(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
            return False
        return one is other or np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(a is b for a, b in zip(one, other, strict=True))
    return one is other or bool(one == other)
