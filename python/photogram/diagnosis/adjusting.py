"""Adjustments of a check: each block once, and which of several changed blocks is what was meant."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import fields
from typing import Any

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.errors import AdjustmentError
from photogram.network.block import Block
from photogram.results.result import Result
from photogram.statistics.likelihood import Judged, judged

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

    def converged(self, block: Block) -> Result | None:
        """Adjust a block; None where that cannot be done, or does not converge."""
        found = self.tried(block)
        return found if found is not None and found.converged else None

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


def put_right(
    first: Result | None, tried: Iterable[tuple[str, Block]], adjusted: Adjuster
) -> tuple[str, Block, Judged] | None:
    """Adjust changed blocks; return the text and the block of the one that explains the residuals, for sure.

    Parameters
    ----------
    first
        What the block leaves as it is; None where it cannot be adjusted.
    tried
        What may have been meant, in words, and the block.
    adjusted
        Adjusts.
    """
    given = math.inf if first is None else first.sums_of_squares.total
    results = [(text, changed, adjusted.tried(changed)) for text, changed in tried]
    left = [
        math.inf if result is None or not result.converged else result.sums_of_squares.total
        for *_, result in results
    ]
    freedom = next((result.degrees_of_freedom for *_, result in results if result is not None), 0)
    if not np.isfinite(left).any() or freedom < 1:
        return None
    # What cannot be adjusted as it is leaves more than anything that can be.
    most = 1e6 * max(each for each in left if math.isfinite(each))
    verdict = judged(min(given, most), left, freedom, known_weight=True)
    if verdict is None or not verdict.accepted:
        return None
    text, changed, _ = results[verdict.best[0]]
    return text, changed, verdict
