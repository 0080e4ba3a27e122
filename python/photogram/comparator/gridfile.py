"""The corrected grid of a calibration as a plate."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from photogram.comparator.calibration import Calibration
    from photogram.comparator.grid import Grid

__all__ = ["corrected_grid"]


def corrected_grid(calibration: Calibration, plate: int) -> Grid:
    """Return a plate with its final average residuals added; points not measured stay as they were."""
    averages = calibration.plates[plate].averages
    grid = calibration.session.grids[plate]
    xy_um = grid.xy_um.copy()
    xy_um[grid.rows_of(averages.points)] += averages.corrections_um
    return replace(grid, xy_um=np.round(xy_um, 4))
