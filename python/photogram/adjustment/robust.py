"""Robust losses as options of an adjustment."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import number, one_of
from photogram.messages import Message
from photogram.words import phrase

LossName = Literal["huber", "cauchy"]
Loss = LossName | tuple[LossName, float]
"""Robust loss, optionally with its scale in a-priori standard deviations."""

SCALES = {"huber": 1.50, "cauchy": 2.55}
"""Scales with 95 percent efficiency for normal errors, for both coordinates of an image point together."""

NOTABLE = 0.5  # Image points with a smaller weight are counted as strongly modified


def loss_row(loss: Loss | None) -> tuple[str, float] | None:
    """Return a loss and its scale for the core; InputError for an invalid loss."""
    if loss is None:
        return None
    if isinstance(loss, tuple) and len(loss) == 2:
        name, scale = loss[0], number("scale of the loss", loss[1], "positive")
        one_of("loss", name, get_args(LossName))
        return (name, scale)
    one_of("loss", loss, get_args(LossName))
    return (loss, SCALES[loss])


def remark(row: tuple[str, float] | None, weights: NDArray[np.float64]) -> list[Message]:
    """Return the note on weights modified by a loss."""
    if row is None:
        return []
    used = weights[np.isfinite(weights)]
    modified, halved = int(np.count_nonzero(used < 1)), int(np.count_nonzero(used < NOTABLE))
    fields = {"loss": row[0], "scale": row[1], "modified": modified, "images": len(used), "halved": halved}
    return [Message(phrase("adjust.loss", **fields))]
