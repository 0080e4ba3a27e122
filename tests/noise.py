"""Blocks as they would be measured, for Monte Carlo tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram import Block

Floats = NDArray[np.float64]


def measured(truth: Block, random: np.random.Generator) -> Block:
    """Return a true block with an error on all that is observed; points that are not control are unknown."""

    def noisy(values: Floats, sd: Floats) -> Floats:
        return values + np.where(np.isfinite(sd), sd, 0.0) * random.standard_normal(values.shape)

    held = np.isfinite(truth.point_sd)
    return truth.replace(
        image_xy=noisy(truth.image_xy, truth.image_sd),
        point_positions=np.where(held, noisy(truth.point_positions, truth.point_sd), np.nan),
        photo_positions=noisy(truth.photo_positions, truth.photo_position_sd),
        photo_attitudes=noisy(truth.photo_attitudes, truth.photo_attitude_sd),
    )
