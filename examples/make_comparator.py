"""Build the packaged example `comparator` from the printed figures of NOAA TR NOS 57.

    python examples/make_comparator.py

The report calibrates comparator 3 with four cases on grid plate 1320; the readings of case 2 survive (its
figure 6). They stand in the deck as printed. Cases 1, 3 and 4 are simulated from what the report found,
always with the same numbers; the README beside the deck says how.
"""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from photogram import comparator
from photogram.comparator import Case, Correction, Place, Polynomial, Reading

ROOT = Path(__file__).resolve().parents[1]
PRINTED = ROOT / "tests" / "data" / "comparator"
EXAMPLE = ROOT / "python" / "photogram" / "examples" / "comparator"

GRID = 1320
OPERATOR = 18
SEED = 1973
RANDOM_UM = 0.843  # figure 30: root of .935^2 - .249^2 - .319^2
POINTING_UM = 0.872  # pooled over case 2


def printed(file: str) -> Any:
    """Return a table or document of printed figures."""
    with (PRINTED / file).open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream)) if file.endswith(".csv") else json.load(stream)


def case_2() -> Case:
    """Return case 2 as it was measured."""
    readings = [
        Reading(GRID, 2, OPERATOR, int(row["leg"]), int(row["point"]), xy, Place())
        for row in printed("fig06_case2_readings.csv")
        if (xy := (float(row["x_um"]), float(row["y_um"])))
    ]
    return comparator.collect_cases(readings)[0]


def true_correction() -> Correction:
    """Return the correction that figure 30 prints."""
    figure = printed("fig30_calibration_summary.json")
    linear = figure["linear"]
    polynomial = Polynomial.from_metres(
        *(np.array(list(figure[f"nonlinear_{axis}"].values())) for axis in "xy")
    )
    return Correction(
        linear["scaler_x"]["value"],
        linear["scaler_y"]["value"],
        math.radians(linear["alpha_dms"][2] / 3600),
        polynomial,
    )


def grid_errors() -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return errors of the grid: average residuals of figure 29, shrunk to its unbiased standard error."""
    summary = printed("fig29_summary.json")
    size = summary["unbiased_grid_standard_error"] / summary["standard_deviation"]["grid"]
    rows = printed("fig29_partial_grid_calibration.csv")
    # The columns are exchanged: the data are left-handed.
    return size * np.array(
        [[float(row["vy_grid_by_point_um"]), float(row["vx_grid_by_point_um"])] for row in rows]
    )


def main() -> None:
    """Write the deck."""
    measured, grid = case_2(), comparator.built_in_grid(GRID)
    correction = true_correction()
    single = comparator.Session((measured,), {GRID: grid}, left_handed=True)
    placed = comparator.calibrate(single, comparator.Options(joint=False)).cases[0]
    middle = correction.apply(placed.placed.means_um).mean(axis=0)
    simulation = comparator.simulate_calibration(
        grid,
        correction,
        rotation_rad=placed.linear.parameters.rotation_rad - math.pi / 2,
        centre_um=(float(middle[0]), float(middle[1])),
        left_handed=True,
        sequence=measured.points.tolist(),
        pointing_um=POINTING_UM,
        random_um=RANDOM_UM,
        grid_errors_um=grid_errors(),
        least_count_um=1.0,
        operators=[OPERATOR],
        comparator=3,
        date="7/17/72",
        seed=SEED,
    )
    first, _, third, fourth = simulation.session.cases
    session = replace(simulation.session, cases=(first, measured, third, fourth))
    EXAMPLE.mkdir(parents=True, exist_ok=True)
    (EXAMPLE / "comparator-3.txt").write_bytes(comparator.to_cards(session))


if __name__ == "__main__":
    main()
