"""Robust losses as options of an adjustment."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import number, one_of
from photogram.errors import InputError
from photogram.messages import Message

__all__ = ["SCALES", "Loss", "loss_row", "remark"]

Loss = Literal["huber", "cauchy"]

SCALES = {"huber": 1.50, "cauchy": 2.55}
"""Scales with which 95 percent of the accuracy of least squares is kept where errors are normal, for the two
coordinates of an image point taken together."""

NOTABLE = 0.5
"""Image points whose weight falls below this fraction are counted as modified strongly."""


def loss_row(loss: Loss | None, scale: float | None) -> tuple[str, float] | None:
    """Return a loss and its scale as the core takes them.

    Raises
    ------
    InputError
        A loss that there is not, a scale that is not positive, or a scale without a loss.
    """
    if loss is None:
        if scale is not None:
            raise InputError("scale is that of a loss: give loss too")
        return None
    one_of("loss", loss, get_args(Loss))
    chosen = SCALES[loss] if scale is None else number("scale", scale)
    if not 0 < chosen < np.inf:
        raise InputError(f"scale must be positive and finite, not {chosen:g}")
    return (loss, chosen)


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
