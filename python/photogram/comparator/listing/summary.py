"""The calibration summary (figure 30)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from photogram.comparator.listing.forms import centred, number
from photogram.comparator.listing.parameters import linear_lines, polynomial_lines

if TYPE_CHECKING:
    from photogram.comparator.calibration import Calibration
    from photogram.comparator.variance import AxisSigma

__all__ = ["summary_page"]


def summary_page(calibration: Calibration) -> list[str]:
    """Return the summary: analysis of variance, linear parameters, polynomials."""
    session, linear, nonlinear = calibration.session, calibration.linear, calibration.nonlinear
    operators = ", ".join(str(operator) for operator in calibration.pointing.operators)
    plates = ", ".join(str(plate) for plate in calibration.plates)
    own = linear.correction
    lines = [
        *centred("CALIBRATION SUMMARY"),
        f"  COMPARATOR NUMBER {session.comparator}   {len(calibration.cases)} CASES   OPERATOR {operators}"
        f"   GRID {plates}   DATE {session.date or '-'}",
        "",
        *variance_lines(calibration),
        "",
        "LINEAR PARAMETERS",
        *linear_lines(own.scale_x, own.scale_y, own.nonorthogonality_rad, linear.covariance),
    ]
    if nonlinear:
        x, y = nonlinear.polynomial.coefficients
        lines += ["", "NONLINEAR PARAMETERS", *polynomial_lines(x, y, nonlinear.covariance)]
    return lines


def variance_lines(calibration: Calibration) -> list[str]:
    """Return the analysis of variance, standard deviations in micrometres."""
    variance = calibration.variance
    head = f"STATISTICAL SUMMARY (MICRONS){'X':>30}{'Y':>10}{'TOTAL':>10}"
    sigmas = [session_sigma(calibration, plate) for plate in calibration.plates]
    return [
        head,
        _line("RMS ERROR BEFORE CALIBRATION", variance.before),
        _line("AFTER LINEAR CORRECTIONS", variance.after_linear),
        _line("AFTER LINEAR AND NONLINEAR CORRECTIONS", variance.after_nonlinear),
        _line("MEAN POINTING", variance.pointing),
        *(
            _total(f"A PRIORI GRID {plate}", sigma)
            for plate, sigma in zip(calibration.plates, sigmas, strict=True)
        ),
        *(
            _total(f"COMPUTED UNBIASED GRID {plate}", calibration.sigma_grid_um(plate))
            for plate in calibration.plates
        ),
        _total("SYSTEMATIC COMPARATOR, LINEAR", variance.linear),
        _total("SYSTEMATIC COMPARATOR, NONLINEAR", variance.nonlinear),
        _total("RANDOM COMPARATOR", variance.random),
    ]


def session_sigma(calibration: Calibration, plate: int) -> float:
    """Return the known standard deviation of a plate; NaN where there is none."""
    sigma = calibration.session.grids[plate].sigma_um
    return math.nan if sigma is None else sigma


def _line(name: str, sigma: AxisSigma | None) -> str:
    values = (sigma.x, sigma.y, sigma.total) if sigma else (None, None, None)
    return f"  {name:<47}" + "".join(number(value, 10, 3) for value in values)


def _total(name: str, value: float) -> str:
    return f"  {name:<67}{number(value, 10, 3)}"
