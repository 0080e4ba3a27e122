"""What is known of a comparison, quantity by quantity."""

from __future__ import annotations

import numpy as np

from photogram.comparator.tables import UM, XY
from photogram.comparator.years.comparison import Comparison
from photogram.show.quantity import Axis, Quantity, of_each

__all__ = ["calibrations", "operators", "points"]


def calibrations(comparison: Comparison) -> list[Quantity]:
    """Return the calibrations: names, days, what of, precision of comparator and pointings."""
    found = comparison.calibrations
    plates = [", ".join(map(str, each.grids)) for each in found]
    celsius, squares = (Axis.of("", "°C"),), (Axis.of("", "um2"),)
    return [
        of_each(found, "name", kind="name", head="Calibration"),
        Quantity([each.day.isoformat() for each in found], kind="name", member="day", head="Day"),
        of_each(found, "comparator", kind="name", member="", head="Of"),
        Quantity(plates, kind="name", head="Plates"),
        Quantity([len(each.cases) for each in found], head="Cases"),
        of_each(found, "temperature_c", celsius, "value", member="", head="Temperature", decimals=1),
        of_each(found, "random_um", UM, "deviation", head="Random comparator", decimals=3),
        of_each(found, "freedom", member="degrees_of_freedom"),
        of_each(found, "pointing_um", XY, "deviation", head="Pointing {}", decimals=3),
        of_each(found, "pointing_covariance_um2", squares, "deviation", head="Covariance", decimals=3),
        of_each(found, "pointing_freedom", member="pointing_degrees_of_freedom"),
    ]


def operators(comparison: Comparison) -> list[Quantity]:
    """Return the operators with the precision of their pointings in all calibrations."""
    values = np.array([*comparison.operators.values()]).reshape(-1, 3)
    pointing, freedom = values[:, :2], values[:, 2].astype(int)
    head = "sd of a pointing in {}"
    return [
        Quantity([*comparison.operators], kind="name", member="operator", head="Operator"),
        Quantity(pointing, XY, "deviation", member="pointing_um", head=head, decimals=3),
        Quantity(freedom, member="degrees_of_freedom", head="Degrees of freedom"),
    ]


def points(comparison: Comparison, plate: int) -> list[Quantity]:
    """Return the points of a plate with their corrections and standard deviations."""
    grid, together = comparison.grids[plate], comparison.together
    axes = tuple(Axis.of(name, "um") for name in "XY")
    sd = np.sqrt(np.diag(together.covariance_um2[plate])).reshape(-1, 2)
    return [
        Quantity(grid.points, head="Point"),
        Quantity(grid.xy_um, axes, "value", head="{}", decimals=3),
        Quantity(together.corrections_um[plate], axes, "deviation", head="Correction of {}", decimals=3),
        Quantity(sd, axes, "deviation", head="sd {}", decimals=3),
    ]
