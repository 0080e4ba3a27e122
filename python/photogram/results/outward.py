"""What the coordinates of a block are called, and the units in which people read their differences."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.network.block import Block
from photogram.show.angles import ARCSEC

__all__ = ["outward"]

Three = tuple[str, str, str]


def outward(block: Block) -> tuple[Three, Three, Floats]:
    """Return names and units of coordinates, and (3,) factors from inner units: seconds of arc for angles."""
    unit = block.linear_unit
    if block.geographic:
        return (
            ("longitude", "latitude", "height"),
            ("arcsec", "arcsec", unit),
            np.array([1.0 / ARCSEC, 1.0 / ARCSEC, 1.0]),
        )
    return ("X", "Y", "Z"), (unit, unit, unit), np.ones(3)
