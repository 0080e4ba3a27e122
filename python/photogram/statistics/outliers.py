"""Residuals that stand out, named: what the problems of a report say of single observations.

The limit of a test depends on how many observations are tested (Bonferroni): of a block without blunders one
in twenty has a residual beyond it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message


@dataclass(frozen=True)
class Observations:
    """Observations of one kind and their test values.

    Attributes
    ----------
    kind
        What they are, in the plural.
    values
        Test values in any shape, of either sign; NaN where nothing is tested.
    name
        Names the observation at an index of `values`.
    """

    kind: str
    values: NDArray[np.float64]
    name: Callable[[tuple[int, ...]], str]


def outliers(groups: list[Observations], limit: Callable[[int], float], what: str) -> list[Message]:
    """Return one remark for each kind of observations that has outliers: how many, and the worst.

    Parameters
    ----------
    groups
        The observations that are tested together.
    limit
        Of the size of a test value, for a number of tests.
    what
        Name of the test value, in the plural.
    """
    sizes = [np.nan_to_num(np.abs(group.values), nan=-1.0, posinf=np.inf) for group in groups]
    allowed = limit(sum(int(np.count_nonzero(size >= 0)) for size in sizes))
    messages = []
    for group, size in zip(groups, sizes, strict=True):
        count = int(np.count_nonzero(size > allowed))
        if count:
            worst = tuple(int(index) for index in np.unravel_index(int(size.argmax()), size.shape))
            messages.append(
                Message(
                    f"{count} of {np.count_nonzero(size >= 0)} {group.kind} have {what} beyond"
                    f" {allowed:.2f}: the largest, {group.values[worst]:.1f}, is that of {group.name(worst)}"
                )
            )
    return messages
