"""Adjustments of a check: stored results, and selection of corrected blocks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.diagnosis.findings import likely
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass
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


@dataclass(frozen=True, eq=False)
class Proposal:
    """A possible mistake, and the block without it."""

    mistake: Phrase
    block: Block


def best_of(
    first: Result | None, proposals: Iterable[Proposal], adjusted: Adjuster
) -> tuple[Proposal, Judged] | None:
    """Adjust the blocks of proposals; return the accepted one and its likelihood.

    `first` is the adjustment of the unchanged block; None if that failed.
    """
    given = math.inf if first is None else first.sums_of_squares.total
    tried = [(each, adjusted.tried(each.block)) for each in proposals]
    left = [
        math.inf if result is None or not result.converged else result.sums_of_squares.total
        for _, result in tried
    ]
    freedom = next((result.degrees_of_freedom for _, result in tried if result is not None), 0)
    if not np.isfinite(left).any() or freedom < 1:
        return None
    # A block that cannot be adjusted counts as worse than all blocks that can.
    most = 1e6 * max(each for each in left if math.isfinite(each))
    verdict = judged(min(given, most), left, freedom, known_weight=True)
    return None if verdict is None or not verdict.accepted else (tried[verdict.best[0]][0], verdict)


def residuals_explained(found: Proposal, verdict: Judged) -> Phrase:
    """Return the message that a mistake explains the residuals."""
    return likely([found.mistake], phrase("mistake.residuals", times=verdict.fall))
