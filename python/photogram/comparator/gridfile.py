"""The corrected grids of a calibration as plates."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.comparator.averages import corrected_grid_sigma
from photogram.comparator.calibration import Calibration
from photogram.comparator.grid import Grid


def corrected_grid(calibration: Calibration, plate: int) -> Grid:
    """Return a plate with its final average residuals added, and what that leaves as its uncertainty.

    Points not measured stay as they were.
    """
    placed = [case.placed for case in calibration.cases]
    rows = [calibration.session.grid_of(case.case).rows_of(case.points) for case in placed]
    known = {number: grid.sigma_um for number, grid in calibration.session.grids.items()}
    stage = calibration.nonlinear or calibration.linear
    sigma = corrected_grid_sigma(rows, placed, stage, known)[plate]
    averages = calibration.plates[plate].averages
    return _of(calibration, plate, averages.points, averages.corrections_um, sigma)


def adjusted_grid(calibration: Calibration, plate: int) -> Grid:
    """Return a plate as the joint adjustment has it, which weighs given coordinates and measurements."""
    assert calibration.joint is not None
    own = calibration.joint.plates[plate]
    variances = np.diagonal(own.covariance_um2, axis1=1, axis2=2)
    return _of(calibration, plate, own.points, own.corrections_um, math.sqrt(float(variances.mean())))


def _of(
    calibration: Calibration, plate: int, points: Indices, corrections_um: Floats, sigma_um: float
) -> Grid:
    session = calibration.session
    when = f"{session.date or 'undated'} by comparator {session.comparator}"
    return corrected(session.grids[plate], points, corrections_um, sigma_um, when)


def corrected(grid: Grid, points: Indices, corrections_um: Floats, sigma_um: float, when: str) -> Grid:
    """Return a plate with corrections, their uncertainty, and what they rest on."""
    xy_um = grid.xy_um.copy()
    xy_um[grid.rows_of(points)] += corrections_um
    return replace(
        grid,
        xy_um=np.round(xy_um, 4),
        sigma_um=None if math.isnan(sigma_um) else sigma_um,
        adopted=f"{when}, from the values of {grid.adopted or 'an unknown date'}",
    )
