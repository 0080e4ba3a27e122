"""Robust losses as options of an adjustment."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import number, one_of
from photogram.errors import InputError
from photogram.messages import Message

__all__ = ["SCALES", "Loss", "LossName", "loss_row", "remark"]

LossName = Literal["huber", "cauchy"]
Loss = LossName | tuple[LossName, float]
"""A robust loss, perhaps with its scale: where it sets in, in standard deviations a priori."""

SCALES = {"huber": 1.50, "cauchy": 2.55}
"""Scales with which 95 percent of the accuracy of least squares is kept where errors are normal, for the two
coordinates of an image point taken together."""

NOTABLE = 0.5  # Image points whose weight falls below this fraction are counted as modified strongly


def loss_row(loss: Loss | None) -> tuple[str, float] | None:
    """Return a loss and its scale as the core takes them; InputError where there is none such."""
    if loss is None:
        return None
    if isinstance(loss, tuple) and len(loss) == 2:
        name, scale = loss[0], number("the scale of the loss", loss[1])
        if not 0 < scale < np.inf:
            raise InputError(f"the scale of the loss must be positive and finite, not {scale:g}")
        one_of("loss", name, get_args(LossName))
        return (name, scale)
    one_of("loss", loss, get_args(LossName))
    return (loss, SCALES[loss])


def remark(row: tuple[str, float] | None, weights: NDArray[np.float64]) -> list[Message]:
    """Say that a loss has modified weights, and what that means for the statistics."""
    if row is None:
        return []
    used = weights[np.isfinite(weights)]
    modified, halved = np.count_nonzero(used < 1), np.count_nonzero(used < NOTABLE)
    return [
        Message(
            f"{row[0].capitalize()} loss of scale {row[1]:g}: weights of {modified} of {len(used)} image"
            f" points were modified, of {halved} to less than half; sums of squares, variance, covariances"
            " and redundancy numbers hold for the modified weights"
        )
    ]
