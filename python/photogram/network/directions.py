"""Where the rays of a block's images come from: directions in the axes of the photos."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.network.block import Block

__all__ = ["direction_deviations", "image_directions"]


def image_directions(block: Block) -> Floats:
    """(m, 3) unit directions of the images of a block in the axes of their photos; NaN where there is none.

    x to the right, y up, z back: the camera looks along -z. Refraction is left out.
    """
    distances = block.principal_distances[block.image_photos]
    return _photocore.image_directions("perspective", distances[:, np.newaxis], block.image_xy)


def direction_deviations(block: Block) -> Floats:
    """(m,) standard deviations of these directions, radians: those of images over the principal distance."""
    distances = np.abs(block.principal_distances[block.image_photos])
    deviations: Floats = np.sqrt((block.image_sd**2).mean(axis=1)) / distances
    return deviations
