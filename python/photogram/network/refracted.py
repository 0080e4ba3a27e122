"""Where the models of refraction do not hold for a block."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram.errors import InputError
from photogram.messages import Message, listed
from photogram.network.block import Block
from photogram.network.motion import on_shared
from photogram.network.refraction import metres_per_unit

__all__ = ["check_cameras", "remarks"]

HIGHEST_GIANT = 9000.0
"""Metres: the flying height up to which Appendix F of the GIANT guide holds."""


def check_cameras(block: Block) -> None:
    """Refuse photos taken from below the water.

    Raises
    ------
    InputError
        A photo whose initial position is at the water level or below.
    """
    refraction = block.refraction
    if refraction is None or refraction.water is None:
        return
    sunk = np.flatnonzero((block.photo_positions[:, 2] <= refraction.water_level) & ~on_shared(block))
    if sunk.size:
        photo = int(sunk[0])
        height, unit = block.photo_positions[photo, 2], block.linear_unit
        raise InputError(
            f"photo {block.photo_ids[photo]} is not above the water: its height is {height:.3f} {unit},"
            f" the water level {refraction.water_level:.3f} {unit}"
        )


def remarks(block: Block, photo_positions: NDArray[np.float64]) -> list[Message]:
    """Say where the models in force do not quite hold.

    Parameters
    ----------
    block
        The block.
    photo_positions
        (P, 3) its adjusted stations.
    """
    refraction = block.refraction
    if refraction is None or (refraction.air is None and refraction.water is None):
        return []
    messages = []
    heights = metres_per_unit(block.linear_unit) * photo_positions[:, 2]
    high = [block.photo_ids[photo] for photo in np.flatnonzero(heights > HIGHEST_GIANT)]
    if refraction.air == "giant" and high:
        messages.append(
            Message(
                f"the air refraction of GIANT holds up to {HIGHEST_GIANT:g} m, below the photos"
                f' {listed(high)}: the model "standard" has no such limit'
            )
        )
    if not block.geographic:
        messages.append(Message("refraction in rectangular space takes Z as the height and the vertical"))
    return messages
