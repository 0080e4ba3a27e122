"""Six simulated calibrations of one comparator over three years, whose x scale steps in between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogram.comparator.calibration import Calibration, calibrate
from photogram.comparator.correction import Correction
from photogram.comparator.grid import built_in_grid
from photogram.comparator.polynomial import Polynomial
from photogram.comparator.simulation import simulate_calibration

__all__ = ["simulated_years"]

DAYS = ("1970-01-15", "1970-07-02", "1971-01-20", "1971-06-28", "1972-01-11", "1972-07-17")
STEP = 20e-6
"""Of the x scale, before the fourth calibration."""


def simulated_years() -> list[Calibration]:
    """Calibrate comparator 3 of the example six times on grid 1320, whose errors stay the same."""
    grid = built_in_grid(1320)
    errors = np.random.default_rng(1320).standard_normal(grid.xy_um.shape) * (grid.sigma_um or 0.0)
    x = np.array([0.012, -0.004, -0.006, 0.003, 0.001, -0.001, 0.0, 0.0, 0.0])
    y = np.array([-0.006, 0.005, 0.003, -0.004, -0.0005, 0.001, 0.0, 0.0, 0.0])
    first = Correction(1 - 7e-6, 1 - 24e-6, 5e-5, Polynomial.from_metres(x, y))
    found = []
    for k, day in enumerate(DAYS):
        own = replace(first, scale_x=first.scale_x + (STEP if k >= 3 else 0.0))
        session = simulate_calibration(
            grid,
            own,
            rotation_rad=0.17 + 0.05 * k,
            pointing_um=0.9,
            random_um=0.7,
            grid_errors_um=errors,
            operators=(18,),
            comparator=3,
            date=day,
            seed=1970 + k,
        ).session
        found.append(calibrate(session))
    return found
