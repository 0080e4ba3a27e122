"""Which of several changed blocks leaves residuals so small that it must be what was meant."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from photogram.diagnosis.adjusting import Adjuster
from photogram.network.block import Block
from photogram.results.result import Result
from photogram.statistics.likelihood import Judged, judged

__all__ = ["put_right"]


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
