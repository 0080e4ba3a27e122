"""Numbers in other units: conversions that preserve numbers as they were typed."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats

TYPED_DECIMALS = 12  # Largest number of decimals in typed numbers

MATRIX_ROUNDING = float(np.degrees(8.0 * np.finfo(float).eps))  # Rounding of angles, degrees


def scaled(values: Floats, factor: float) -> Floats:
    """Return values times a factor, as if they had been typed in the other unit."""
    return _typed(values * factor, 0.0)


def degrees_typed(radians: Floats, rounding: float = 0.0) -> Floats:
    """Return angles in degrees, with the decimals that were typed."""
    return _typed(np.degrees(radians), rounding)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _typed(values: Floats, rounding: float) -> Floats:
    """Return numbers as short decimals if only rounding separates them."""
    size = np.abs(values)
    decimals = np.clip(11.0 - np.floor(np.log10(size)), 0.0, TYPED_DECIMALS)
    short = np.rint(values * 10.0**decimals) / 10.0**decimals
    return np.where(np.abs(short - values) <= 4.0 * np.spacing(size) + rounding, short, values)
