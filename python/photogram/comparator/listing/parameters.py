"""Linear parameters and polynomials, of one case and of all (figures 17, 18, 21 and 22)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.listing.forms import angle, centred, nearest, triangle
from photogram.comparator.listing.residuals import residual_lines
from photogram.comparator.polynomial import TERMS
from photogram.show.angles import ARCSEC

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.calibration import Calibration, CaseResult
    from photogram.comparator.combined_solution import SinglePolynomial

__all__ = [
    "case_linear_page",
    "case_polynomial_page",
    "combined_linear_page",
    "combined_polynomial_page",
    "linear_lines",
    "polynomial_lines",
]

NAMES = ("SCALE X", "SCALE Y", "ALPHA")
LETTERS = "ABCDEFGHJ"


def linear_lines(scale_x: float, scale_y: float, lean: float, covariance: Floats) -> list[str]:
    """Return scales and lack of orthogonality with their standard deviations and covariances."""
    sd = np.sqrt(np.diag(covariance))
    ratio = scale_x / scale_y
    return [
        f"  SCALER X {scale_x:14.8f}   SIGMA {sd[0]:12.5E}   SX - 1 = {_ppm(scale_x)}",
        f"  SCALER Y {scale_y:14.8f}   SIGMA {sd[1]:12.5E}   SY - 1 = {_ppm(scale_y)}",
        f"  SX/SY    {ratio:14.8f}   {'':18}   SX/SY-1= {_ppm(ratio)}",
        f"  LACK OF ORTHOGONALITY ALPHA {angle(lean)}   SIGMA {sd[2] / ARCSEC:8.3f} SEC",
        "  VARIANCES AND COVARIANCES (ALPHA IN RADIANS)",
        *triangle(NAMES, covariance[:3, :3]),
    ]


def _ppm(scale: float) -> str:
    return f"{1e6 * (scale - 1):10.4f} MICRONS/METER"


def polynomial_lines(x: Floats, y: Floats, covariance: Floats) -> list[str]:
    """Return the coefficients in metre units with standard deviations (one covariance for both axes)."""
    sd = np.sqrt(np.diag(covariance))
    lines = [
        "  CORRECTION = A X**4 + B Y**4 + C X**3 + D Y**3 + E X**2 + F Y**2 + G X + H Y + J   (METERS)",
        f"  {'':12}{'IN X':>16}{'SIGMA':>16}{'IN Y':>16}{'SIGMA':>16}",
    ]
    for row, (letter, term) in enumerate(zip(LETTERS, TERMS, strict=True)):
        values = f"{x[row]:16.8E}{sd[row]:16.5E}{y[row]:16.8E}{sd[len(TERMS) + row]:16.5E}"
        lines.append(f"  {letter}   {term:<8}{values}")
    return lines


def case_linear_page(case: CaseResult) -> list[str]:
    """Return the linear adjustment of one case."""
    fit = case.linear
    own = fit.parameters
    return [
        *centred(f"CASE NUMBER {case.number} LINEAR ADJUSTMENT"),
        nearest(case),
        "",
        *linear_lines(own.scale_x, own.scale_y, own.nonorthogonality_rad, fit.covariance),
        f"  ROTATION {angle(own.rotation_rad)}   SIGMA {math.sqrt(fit.covariance[3, 3]) / ARCSEC:8.3f} SEC",
        "",
        *residual_lines(fit.residuals),
    ]


def case_polynomial_page(case: CaseResult, single: SinglePolynomial) -> list[str]:
    """Return the polynomials of one case."""
    x, y = single.polynomial.coefficients
    return [
        *centred(f"CASE NUMBER {case.number} NONLINEAR ADJUSTMENT"),
        nearest(case),
        "",
        *polynomial_lines(x, y, single.covariance),
        "  VARIANCES AND COVARIANCES, IN X AND IN Y (METERS)",
        *triangle(LETTERS, single.covariance[:9, :9]),
        "",
        *residual_lines(single.residuals),
    ]


def combined_linear_page(calibration: Calibration) -> list[str]:
    """Return the combined linear adjustment."""
    linear = calibration.linear
    own = linear.correction
    placements = [
        f"  CASE {case.number:3d}  ROTATION {angle(fit.rotation_rad)}   TRANSLATION"
        f"{fit.translation_um[0]:14.2f}{fit.translation_um[1]:14.2f} MICRONS"
        for case, fit in zip(calibration.cases, linear.cases, strict=True)
    ]
    return [
        *centred(f"COMBINED LINEAR ADJUSTMENT OF {len(calibration.cases)} CASES"),
        *linear_lines(own.scale_x, own.scale_y, own.nonorthogonality_rad, linear.covariance),
        "",
        f"  STANDARD ERROR OF UNIT WEIGHT = {linear.sigma0_um:.4f} MICRONS"
        f"   DEGREES OF FREEDOM = {linear.degrees_of_freedom}",
        "",
        *placements,
    ]


def combined_polynomial_page(calibration: Calibration) -> list[str]:
    """Return the combined polynomials; without polynomials an empty page."""
    nonlinear = calibration.nonlinear
    if nonlinear is None:
        return []
    x, y = nonlinear.polynomial.coefficients
    sigma_x, sigma_y = nonlinear.sigma_um
    return [
        *centred(f"COMBINED NONLINEAR ADJUSTMENT OF {len(calibration.cases)} CASES"),
        *polynomial_lines(x, y, nonlinear.covariance),
        "  VARIANCES AND COVARIANCES, IN X AND IN Y (METERS)",
        *triangle(LETTERS, nonlinear.covariance[:9, :9]),
        "",
        f"  SIGMA X = {sigma_x:.4f}   SIGMA Y = {sigma_y:.4f}"
        f"   STANDARD ERROR OF UNIT WEIGHT = {nonlinear.sigma0_um:.4f} MICRONS"
        f"   DEGREES OF FREEDOM = {nonlinear.degrees_of_freedom}",
    ]
