"""Robust losses as options of an adjustment."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import argument_error, number, one_of
from photogram.messages import Message
from photogram.words import phrase

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
            raise argument_error("scale of the loss", "positive", value=scale)
        one_of("loss", name, get_args(LossName))
        return (name, scale)
    one_of("loss", loss, get_args(LossName))
    return (loss, SCALES[loss])


def remark(row: tuple[str, float] | None, weights: NDArray[np.float64]) -> list[Message]:
    """Return the remark on weights that a loss has modified."""
    if row is None:
        return []
    used = weights[np.isfinite(weights)]
    modified, halved = int(np.count_nonzero(used < 1)), int(np.count_nonzero(used < NOTABLE))
    fields = {"loss": row[0], "scale": row[1], "modified": modified, "images": len(used), "halved": halved}
    return [Message(phrase("adjust.loss", **fields))]
