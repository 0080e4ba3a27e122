"""How an adjustment of a block ended, where a reader must be careful: remarks with the names concerned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.messages import Message, listed
from photogram.network.block import ATTITUDE_COLUMNS, Block, position_columns

if TYPE_CHECKING:
    from photogram import _photocore
    from photogram.errors import AdjustmentError

__all__ = ["behind", "rounded", "undetermined"]

NOTABLE_EXCESS = 1e-5
"""Redundancy numbers whose sum is further off have fewer digits than are printed of them."""


def undetermined(
    block: Block, solution: _photocore.BlockSolution, error: AdjustmentError | None
) -> list[Message]:
    """Remark on what the adjusted values leave undetermined, `error`, or determine only weakly."""
    messages = []
    if error is not None:
        messages.append(Message(f"there are no covariances: {error}"))
    if solution.weak:
        names = [*position_columns(block), *ATTITUDE_COLUMNS]
        moved = [
            f"{names[unknown].removesuffix('_deg')} of"
            f" {listed([block.photo_ids[photo] for photo, other in solution.weak if other == unknown])}"
            for unknown in sorted({unknown for _, unknown in solution.weak})
        ]
        messages.append(
            Message(
                "the sum of squares stands still, but the observations hardly determine a combination of"
                f" unknowns that moves {'; '.join(moved)}: other values along it fit as well"
            )
        )
    return messages


def rounded(excess: float | None) -> list[Message]:
    """Remark on cofactors and redundancy numbers that rounding has reached.

    Parameters
    ----------
    excess
        Sum of all redundancy numbers minus the degrees of freedom; None where it is not known.
    """
    if excess is None or abs(excess) <= NOTABLE_EXCESS:
        return []
    return [
        Message(
            f"the redundancy numbers sum to the degrees of freedom only within {abs(excess):.1g}: the network"
            " holds together so weakly that standard deviations and test values lose digits to rounding, and"
            " are about as wrong"
        )
    ]


def behind(block: Block, solution: _photocore.BlockSolution) -> list[Message]:
    """Remark on image points whose point stands behind the camera: no ray can have made them."""
    images = solution.images_behind
    if not images.size:
        return []
    points = [block.point_ids[point] for point in np.unique(block.image_points[images])]
    photos = [block.photo_ids[photo] for photo in np.unique(block.image_photos[images])]
    count = "1 image point has its" if len(images) == 1 else f"{len(images)} image points have their"
    text = f"{count} point behind the camera: points {listed(points)} on photos {listed(photos)}"
    return [Message(text)]
