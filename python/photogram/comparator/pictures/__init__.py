"""Plots of a calibration by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from photogram.comparator.pictures.correction import correction_surface, distorted_grid
from photogram.comparator.pictures.ellipses import (
    operator_ellipses,
    pointing_ellipses,
    pooled_ellipses,
    total_ellipses,
)
from photogram.comparator.pictures.statistics import residual_histogram, variance_bars
from photogram.comparator.pictures.vectors import (
    average_vectors,
    comparator_vectors,
    grid_vectors,
    joint_grid,
)
from photogram.show.sketch.plot import Plot

if TYPE_CHECKING:
    from photogram.comparator import Calibration

__all__ = ["sketches"]


def sketches(calibration: Calibration) -> dict[str, Plot]:
    """Return all plots of a calibration, by short names."""
    return {name: plotter() for name, plotter in plotters(calibration).items()}


def plotters(calibration: Calibration) -> dict[str, Callable[[], Plot]]:
    """Return the plot functions of a calibration, by short names."""
    nonlinear, joint = calibration.nonlinear, calibration.joint
    made: dict[str, Callable[[], Plot]] = {
        "variance": partial(variance_bars, calibration),
        "comparator-residuals": partial(comparator_vectors, calibration),
        "grid-residuals": partial(grid_vectors, calibration),
    }
    for plate in calibration.plates:
        made[f"average-residuals-{plate}"] = partial(average_vectors, calibration, plate)
        if joint and joint.plates[plate].sigma_um > 0:
            made[f"grid-corrections-{plate}"] = partial(joint_grid, calibration, plate)
    polynomials = [("", "", nonlinear.polynomial)] if nonlinear else []
    polynomials += [
        (f"-case-{case.number}", f", case {case.number} alone", case.polynomial.polynomial)
        for case in calibration.cases
        if calibration.session.plot_each_case and case.polynomial
    ]
    for ending, whose, polynomial in polynomials:
        made[f"correction{ending}"] = partial(correction_surface, calibration, polynomial, whose)
        made[f"distorted-grid{ending}"] = partial(distorted_grid, calibration, polynomial, whose)
    made["pointing-ellipses"] = partial(pointing_ellipses, calibration)
    for operator in calibration.pointing.operators:
        made[f"pointing-ellipses-operator-{operator}"] = partial(operator_ellipses, calibration, operator)
    return made | {
        "pointing-ellipses-total": partial(total_ellipses, calibration),
        "pooled-ellipses": partial(pooled_ellipses, calibration),
        "residual-histogram": partial(residual_histogram, calibration),
    }
