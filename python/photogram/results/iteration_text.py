"""Iterations as people read them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.results.iteration import Iteration
from photogram.show.quantity import Quantity


def iteration_table(iterations: Sequence[Iteration], start: float | None = None) -> list[Quantity]:
    """Return numbers, sums after the corrections, largest changes, damping; first the start, if given."""
    first = [] if start is None else [(0, start, np.nan, np.nan)]
    rows = [(i.number, i.weighted_sum_of_squares, i.largest_change, i.damping) for i in iterations]
    number, squares, change, damping = np.array([*first, *rows]).reshape(-1, 4).T
    return [
        Quantity(number.astype(int), member="number", head="Iteration", decimals=0),
        Quantity(squares, member="weighted_sum_of_squares", head="Weighted sum of squares", figures=7),
        Quantity(change, member="largest_change_sd", head="Largest change over sd"),
        Quantity(damping, member="damping", head="Damping", figures=2),
    ]
