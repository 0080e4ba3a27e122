"""Adjustments of a check: stored results, and selection of corrected blocks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.diagnosis.findings import likely
from photogram.errors import AdjustmentError
from photogram.network.block import Block
from photogram.results.result import Result
from photogram.statistics.likelihood import Judged, judged
from photogram.words import Phrase, phrase

KEPT = 2  # Adjustments that are stored


class Adjuster:
    """Adjusts blocks with the same options, and stores the last results."""

    def __init__(self, options: dict[str, Any]) -> None:
        self.options = options
        self._known: list[tuple[Block, Result | AdjustmentError]] = []

    def __call__(self, block: Block) -> Result:
        """Adjust a block; raise the same error for the same block."""
        result = next((result for known, result in self._known if known == block), None)
        if result is None:
            try:
                result = adjust(block, **self.options)
            except AdjustmentError as error:
                result = error
            self._known = [*self._known[1 - KEPT :], (block, result)]
        if isinstance(result, AdjustmentError):
            raise result
        return result

    def tried(self, block: Block) -> Result | None:
        """Adjust a block; None if that fails."""
        try:
            return self(block)
        except AdjustmentError:
            return None

    def converged(self, block: Block) -> Result | None:
        """Adjust a block; None if that fails or does not converge."""
        result = self.tried(block)
        return result if result is not None and result.converged else None

    def otherwise(self, **options: Any) -> Adjuster:
        """Return an adjuster with changed options."""
        return Adjuster({**self.options, **options})


def put_right(
    first: Result | None, tried: Iterable[tuple[Phrase, Block]], adjusted: Adjuster
) -> tuple[Phrase, Block, Judged] | None:
    """Adjust corrected blocks; return the message on the mistake, and the block, that explain residuals.

    `first` is the adjustment of the unchanged block; None if that failed.
    """
    given = math.inf if first is None else first.sums_of_squares.total
    results = [(mistake, changed, adjusted.tried(changed)) for mistake, changed in tried]
    left = [
        math.inf if result is None or not result.converged else result.sums_of_squares.total
        for *_, result in results
    ]
    freedom = next((result.degrees_of_freedom for *_, result in results if result is not None), 0)
    if not np.isfinite(left).any() or freedom < 1:
        return None
    # A block that cannot be adjusted counts as worse than all blocks that can.
    most = 1e6 * max(each for each in left if math.isfinite(each))
    verdict = judged(min(given, most), left, freedom, known_weight=True)
    if verdict is None or not verdict.accepted:
        return None
    mistake, changed, _ = results[verdict.best[0]]
    return likely([mistake], phrase("mistake.residuals", times=verdict.fall)), changed, verdict
