"""How firmly the photos of a block hang together: points that tie a photo to the rest."""

from __future__ import annotations

import numpy as np

from photogram.network.block import Block

FEWEST_TIES = 3  # Points that the orientation of a photo needs at least


def ties(block: Block) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """(P,) points of each photo that another photo or control ties."""
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    useful = (rays >= 2) | np.isfinite(block.point_sd).any(axis=1)
    return np.bincount(block.image_photos[useful[block.image_points]], minlength=len(block.photo_ids))
