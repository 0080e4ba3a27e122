"""Simulated calibrations with true values, for tests, planning and the packaged example."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.arguments.arrays import shaped, truth_value, whole_number
from photogram.arguments.types import Floats
from photogram.comparator.calibration import Calibration, calibrate
from photogram.comparator.case import exchanged
from photogram.comparator.correction import Correction
from photogram.comparator.fits import Polynomial, rotation_matrix
from photogram.comparator.grid import Grid, built_in_grid
from photogram.comparator.readings import Case, Session
from photogram.errors import InputError
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass, replace
from photogram.words import phrase

IDEAL = Correction(1.0, 1.0, 0.0)


@dataclass(frozen=True, eq=False)
class Simulation:
    """Simulated session and its true values.

    Attributes
    ----------
    session
        Simulated measurements.
    correction
        The true correction.
    grid_errors_um
        (l, 2) true minus given grid coordinates, in the axes of the plate.
    """

    session: Session
    correction: Correction
    grid_errors_um: Floats


def simulate_calibration(
    grid: Grid,
    correction: Correction = IDEAL,
    *,
    cases: int = 4,
    rotation_rad: float = math.atan(0.2),
    centre_um: tuple[float, float] = (125_000.0, 130_000.0),
    left_handed: bool = False,
    sequence: Sequence[int] | None = None,
    pointing_um: float = 0.0,
    random_um: float = 0.0,
    grid_um: float = 0.0,
    grid_errors_um: Floats | None = None,
    least_count_um: float = 0.0,
    operators: Sequence[int] = (1,),
    comparator: int = 1,
    date: str = "",
    seed: int = 0,
) -> Simulation:
    """Simulate the measurement of a plate in placements rotated by 90 degrees each.

    Parameters
    ----------
    grid
        Plate with given coordinates.
    correction
        True correction of the readings.
    cases, rotation_rad, centre_um
        Number of placements, rotation of the first, and corrected comparator coordinates of the plate centre.
    left_handed
        Whether the comparator is left-handed relative to the plate.
    sequence
        Points in the order of the pointings of a case. None: five on each, row by row, and three on the first
        again.
    pointing_um, random_um, grid_um
        Standard deviations of a single pointing, of the comparator (one error per point and case), and of the
        given grid coordinates.
    grid_errors_um
        (l, 2) true minus given grid coordinates, instead of random ones.
    least_count_um
        Least count for rounding of readings; 0 disables rounding.
    operators
        Operators, one per four cases.
    comparator, date, seed
        Number, date, and seed of the random numbers.

    Raises
    ------
    InputError
        If `operators` is empty, if the rotation is infinite, if the seed is negative, or if the errors have
        another shape.
    """
    truth_value("left_handed", left_handed)
    if not operators or not math.isfinite(rotation_rad) or seed < 0:
        fields = {"operators": list(operators), "rotation": rotation_rad, "seed": seed}
        raise InputError(phrase("comparators.simulation", **fields))
    random = np.random.default_rng(seed)
    drawn = grid_um * random.standard_normal((len(grid.points), 2))
    errors = drawn if grid_errors_um is None else shaped("grid_errors_um", grid_errors_um, drawn.shape)
    plate = replace(grid, xy_um=grid.xy_um + errors)
    points = np.concatenate([np.repeat(grid.points, 5), np.repeat(grid.points[:1], 3)])
    if sequence is not None:
        points = np.array(sequence, dtype=np.int64)
    rows = grid.rows_of(points)
    measured, places = [], exchanged(plate.xy_um, left_handed)
    places = places - (places.min(axis=0) + places.max(axis=0)) / 2
    for k in range(whole_number("cases", cases)):
        turned = places @ rotation_matrix(rotation_rad + k * math.pi / 2)
        exact = correction.invert(turned + centre_um)
        exact = exact + random_um * random.standard_normal(exact.shape)
        xy = exact[rows] + pointing_um * random.standard_normal((len(rows), 2))
        if least_count_um > 0:
            xy = np.round(xy / least_count_um) * least_count_um
        operator = operators[min(k // 4, len(operators) - 1)]
        legs, origins = np.zeros(len(rows), dtype=np.int64), (Place(),) * len(rows)
        measured.append(Case(k + 1, operator, grid.number, grid.points[rows], legs, xy, origins))
    session = Session(
        tuple(measured), {grid.number: grid}, comparator=comparator, date=date, left_handed=left_handed
    )
    return Simulation(session, correction, errors)


DAYS = ("1970-01-15", "1970-07-02", "1971-01-20", "1971-06-28", "1972-01-11", "1972-07-17")
STEP = 20e-6  # Step of the x scale before the fourth calibration


def simulated_years() -> list[Calibration]:
    """Simulate six calibrations of comparator 3 on grid 1320 with constant errors."""
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
