"""What the tests of the comparator share: figures of the report, its case 2, simulated calibrations."""

import csv
import json
import math
from functools import cache
from pathlib import Path

import numpy as np

from photogram.comparator import (
    Correction,
    Grid,
    Options,
    Place,
    Polynomial,
    Reading,
    Session,
    built_in_grid,
    calibrate,
    collect_cases,
    simulate_calibration,
)

PRINTED = Path(__file__).parents[1] / "data" / "comparator"
ARCSEC = math.radians(1 / 3600)
QUICK = Options(joint=False)
LINEAR = Options(joint=False, polynomial=False)


@cache
def table(name):
    """Return the rows of a table of printed figures."""
    with (PRINTED / name).open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@cache
def document(name):
    """Return a document of printed figures."""
    return json.loads((PRINTED / name).read_bytes())


def case_2_session():
    """Return case 2 of the report, with the places of its readings."""
    readings = [
        Reading(
            1320,
            2,
            18,
            int(row["leg"]),
            int(row["point"]),
            (float(row["x_um"]), float(row["y_um"])),
            Place(PRINTED / "fig06_case2_readings.csv", int(row["seq"]) + 1),
        )
        for row in table("fig06_case2_readings.csv")
    ]
    return Session(collect_cases(readings), {1320: built_in_grid(1320)}, comparator=3, left_handed=True)


@cache
def case_2():
    """Return the calibration by case 2 alone."""
    return calibrate(case_2_session())


def printed_polynomial():
    """Return the polynomials of figure 30."""
    figure = document("fig30_calibration_summary.json")
    return Polynomial.from_metres(
        *(np.array(list(figure[f"nonlinear_{axis}"].values())) for axis in ("x", "y"))
    )


def printed_correction():
    """Return the correction of figure 30."""
    linear = document("fig30_calibration_summary.json")["linear"]
    # Printed with more digits as micrometres a metre.
    return Correction(
        1 + 1e-6 * linear["scaler_x_um_per_m"],
        1 + 1e-6 * linear["scaler_y_um_per_m"],
        linear["alpha_dms"][2] * ARCSEC,
        printed_polynomial(),
    )


def bent():
    """Return a correction with polynomials of a few micrometres, without linear terms."""
    x = np.array([0.02, -0.01, -0.012, 0.008, 0.002, -0.001, 0.0, 0.0, 0.0])
    y = np.array([-0.006, 0.015, 0.003, -0.009, -0.0005, 0.0015, 0.0, 0.0, 0.0])
    return Correction(1 - 5e-6, 1 - 22e-6, 5e-5, Polynomial.from_metres(x, y))


STRAIGHT = Correction(1 - 5e-6, 1 - 22e-6, 5e-5)


def noisy(seed, *, grid=None, correction=STRAIGHT, **options):
    """Return a simulated session with the errors of an ordinary comparator."""
    errors = {"pointing_um": 0.9, "random_um": 0.6, "grid_um": 0.3, **options}
    return simulate_calibration(grid or Grid.square(sigma_um=0.3), correction, seed=seed, **errors).session
