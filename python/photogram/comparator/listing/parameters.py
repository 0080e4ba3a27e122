"""Listing pages of parameters, corrections and summary (figures 17 to 23, 30)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.combined_solution import CombinedPolynomial, SinglePolynomial
from photogram.comparator.correction import Correction
from photogram.comparator.fits import Decomposition, Residuals
from photogram.comparator.polynomial import TERMS, Polynomial
from photogram.comparator.tables import linear, variance
from photogram.io.angles import ARCSEC, degrees_minutes_seconds

if TYPE_CHECKING:
    from photogram.comparator import Calibration, CaseResult

NAMES = ("SCALE X", "SCALE Y", "ALPHA")
LETTERS = "ABCDEFGHJ"
STAGES = 4  # lines of the analysis of variance with values of both axes


def linear_lines(found: Correction | Decomposition, covariance: Floats) -> list[str]:
    """Return scales and lack of orthogonality with their covariances."""
    (x, y, ratio, lean), sd, less_one = (column.values for column in linear(found, covariance).columns[1:])
    of_x, of_y, of_ratio = (f"{value:10.4f} MICRONS/METER" for value in less_one[:3])
    return [
        f"  SCALER X {x:14.8f}   SIGMA {sd[0]:12.5E}   SX - 1 = {of_x}",
        f"  SCALER Y {y:14.8f}   SIGMA {sd[1]:12.5E}   SY - 1 = {of_y}",
        f"  SX/SY    {ratio:14.8f}   {'':18}   SX/SY-1= {of_ratio}",
        f"  LACK OF ORTHOGONALITY ALPHA {angle(lean)}   SIGMA {sd[3] / ARCSEC:8.3f} SEC",
        "  VARIANCES AND COVARIANCES (ALPHA IN RADIANS)",
        *triangle(NAMES, covariance[:3, :3]),
    ]


def polynomial_lines(polynomial: Polynomial, covariance: Floats) -> list[str]:
    """Return the coefficients in metre units with standard deviations."""
    (x, y), sd = polynomial.coefficients, np.sqrt(np.diag(covariance))
    lines = [
        "  CORRECTION = A X**4 + B Y**4 + C X**3 + D Y**3 + E X**2 + F Y**2 + G X + H Y + J   (METERS)",
        f"  {'':12}{'IN X':>16}{'SIGMA':>16}{'IN Y':>16}{'SIGMA':>16}",
    ]
    for row, (letter, term) in enumerate(zip(LETTERS, TERMS, strict=True)):
        values = f"{x[row]:16.8E}{sd[row]:16.5E}{y[row]:16.8E}{sd[len(TERMS) + row]:16.5E}"
        lines.append(f"  {letter}   {term:<8}{values}")
    return lines


def covariance_lines(fit: SinglePolynomial | CombinedPolynomial) -> list[str]:
    """Return the coefficients with their covariances, which are equal in x and in y."""
    return [
        *polynomial_lines(fit.polynomial, fit.covariance),
        "  VARIANCES AND COVARIANCES, IN X AND IN Y (METERS)",
        *triangle(LETTERS, fit.covariance[:9, :9]),
    ]


def case_linear_page(case: CaseResult) -> list[str]:
    """Return the page of the linear adjustment of one case."""
    fit = case.linear
    own, sd = fit.parameters, math.sqrt(fit.covariance[3, 3]) / ARCSEC
    rotation = f"  ROTATION {angle(own.rotation_rad)}   SIGMA {sd:8.3f} SEC"
    lines = [*linear_lines(own, fit.covariance), rotation, ""]
    return residual_page(f"CASE NUMBER {case.number} LINEAR ADJUSTMENT", case, fit.residuals, lines)


def case_polynomial_page(case: CaseResult, single: SinglePolynomial) -> list[str]:
    """Return the page of the polynomials of one case."""
    title = f"CASE NUMBER {case.number} NONLINEAR ADJUSTMENT"
    return residual_page(title, case, single.residuals, [*covariance_lines(single), ""])


def combined_linear_page(calibration: Calibration) -> list[str]:
    """Return the page of the combined linear adjustment."""
    combined = calibration.linear
    placements = [
        f"  CASE {case.number:3d}  ROTATION {angle(fit.rotation_rad)}   TRANSLATION"
        f"{fit.translation_um[0]:14.2f}{fit.translation_um[1]:14.2f} MICRONS"
        for case, fit in zip(calibration.cases, combined.cases, strict=True)
    ]
    return [
        *centred(f"COMBINED LINEAR ADJUSTMENT OF {len(calibration.cases)} CASES"),
        *linear_lines(combined.correction, combined.covariance),
        "",
        f"  STANDARD ERROR OF UNIT WEIGHT = {combined.sigma0_um:.4f} MICRONS"
        f"   DEGREES OF FREEDOM = {combined.degrees_of_freedom}",
        "",
        *placements,
    ]


def combined_polynomial_page(calibration: Calibration) -> list[str]:
    """Return the page of the combined polynomials, empty without polynomials."""
    nonlinear = calibration.nonlinear
    if nonlinear is None:
        return []
    sigma_x, sigma_y = nonlinear.sigma_um
    return [
        *centred(f"COMBINED NONLINEAR ADJUSTMENT OF {len(calibration.cases)} CASES"),
        *covariance_lines(nonlinear),
        "",
        f"  SIGMA X = {sigma_x:.4f}   SIGMA Y = {sigma_y:.4f}"
        f"   STANDARD ERROR OF UNIT WEIGHT = {nonlinear.sigma0_um:.4f} MICRONS"
        f"   DEGREES OF FREEDOM = {nonlinear.degrees_of_freedom}",
    ]


STEP_UM = 25_000.0  # Distance of the nodes
ROWS = 9


def table_nodes(centre_um: float) -> list[Floats]:
    """Return the nodes of the program's table: nine rows of decreasing x.

    Each row is (9, 2) or (5, 2) with decreasing y. The nodes are centred on the comparator range (TRANS) and
    extend 0.1 m to either side.
    """
    steps = STEP_UM * np.arange(ROWS // 2, -(ROWS // 2) - 1, -1)
    rows = []
    for row, x in enumerate(steps.tolist()):
        y = steps if row % 2 == 0 else steps[::2]
        rows.append(centre_um + np.column_stack([np.full(len(y), x), y]))
    return rows


def correction_table(calibration: Calibration, case: CaseResult | None = None) -> list[str]:
    """Return the corrections at fixed nodes, of a case or of the combined adjustment."""
    source = case.polynomial if case else calibration.nonlinear
    if source is None:
        return []
    polynomial = source.polynomial
    nodes = table_nodes(calibration.session.centre_um)
    whose = f"CASE NUMBER {case.number}" if case else f"{len(calibration.cases)} CASES"
    lines = centred(f"NONLINEAR CORRECTIONS, {whose} (MICRONS)")
    outside = False
    for row in nodes:
        values = polynomial.evaluate(row)
        gap = "" if len(row) == len(nodes) else " " * 11
        reach = np.abs(polynomial.frame.arguments(row)).max(axis=1)
        marks = [" " if distance <= 1 + 1e-9 else "*" for distance in reach.tolist()]
        outside = outside or "*" in marks
        for axis, head in enumerate((f"X={row[0, 0] / 1e6:7.4f} M.", " " * 12)):
            cells = [f"{value:10.3f}{mark}" for value, mark in zip(values[:, axis], marks, strict=True)]
            lines.append(head + gap.join(cells))
        lines.append("")
    places = "".join(f"{y / 1e6:10.4f} " for y in nodes[0][:, 1])
    lines += [f"Y= (METERS) {places}", "UPPER NUMBER IN X, LOWER NUMBER IN Y"]
    return [*lines, "* OUTSIDE THE RANGE MEASURED"] if outside else lines


def summary_page(calibration: Calibration) -> list[str]:
    """Return the summary page: analysis of variance, linear parameters, polynomials."""
    session, combined, nonlinear = calibration.session, calibration.linear, calibration.nonlinear
    operators = ", ".join(str(operator) for operator in calibration.pointing.operators)
    plates = ", ".join(str(plate) for plate in calibration.plates)
    lines = [
        *centred("CALIBRATION SUMMARY"),
        f"  COMPARATOR NUMBER {session.comparator}   {len(calibration.cases)} CASES   OPERATOR {operators}"
        f"   GRID {plates}   DATE {session.date or '-'}",
        "",
        *variance_lines(calibration),
        "",
        "LINEAR PARAMETERS",
        *linear_lines(combined.correction, combined.covariance),
    ]
    if nonlinear:
        polynomial = polynomial_lines(nonlinear.polynomial, nonlinear.covariance)
        lines += ["", "NONLINEAR PARAMETERS", *polynomial]
    return lines


def variance_lines(calibration: Calibration) -> list[str]:
    """Return the analysis of variance, standard deviations in micrometres."""
    names = [
        "RMS ERROR BEFORE CALIBRATION",
        "AFTER LINEAR CORRECTIONS",
        "AFTER LINEAR AND NONLINEAR CORRECTIONS",
        "MEAN POINTING",
        *(f"A PRIORI GRID {plate}" for plate in calibration.plates),
        *(f"COMPUTED UNBIASED GRID {plate}" for plate in calibration.plates),
        "SYSTEMATIC COMPARATOR, LINEAR",
        "SYSTEMATIC COMPARATOR, NONLINEAR",
        "RANDOM COMPARATOR",
    ]
    lines = [f"STATISTICAL SUMMARY (MICRONS){'X':>30}{'Y':>10}{'TOTAL':>10}"]
    for row, (name, values) in enumerate(zip(names, variance(calibration).columns[1].values, strict=True)):
        axes = "".join(number(value, 10, 3) for value in values[:2]) if row < STAGES else ""
        lines.append(f"  {name:<47}{axes:20}{number(values[2], 10, 3)}")
    return lines


WIDTH = 110


def centred(title: str) -> list[str]:
    """Return a title with a blank line below."""
    return [title.center(WIDTH), ""]


def nearest(case: CaseResult) -> str:
    """Return the orientation line of a case."""
    point = case.placed.orientation.nearest_point
    return f"GRID POINT {point} IS NEAREST THE COMPARATOR ORIGIN"


def number(value: float | None, width: int, decimals: int) -> str:
    """Return a number in its field; a missing one as a dash."""
    if value is None or math.isnan(value):
        return "-".rjust(width)
    return f"{value:{width}.{decimals}f}"


def angle(radians: float) -> str:
    """Return an angle in degrees, minutes and seconds of arc."""
    degrees, minutes, seconds = degrees_minutes_seconds(radians, 3)
    sign = "-" if radians < 0 and (degrees or minutes or seconds) else " "
    return f"{sign}{degrees:3d} DEG {minutes:2d} MIN {seconds:6.3f} SEC"


def triangle(names: Iterable[str], matrix: Floats) -> list[str]:
    """Return the lower triangle of a covariance matrix, with names."""
    rows = []
    for row, name in enumerate(names):
        values = "".join(f"{value:13.5E}" for value in np.asarray(matrix)[row, : row + 1])
        rows.append(f"  {name:<8}{values}")
    return rows


HEAD = [
    "                                         RESIDUALS, MEASURED SYSTEM            RESIDUALS, GRID SYSTEM",
    "  PT.NO.        X ADJ        Y ADJ           VX         VY            NO.          VX         VY",
]


def residual_page(
    title: str, case: CaseResult, residuals: Residuals, parameters: Sequence[str] = ()
) -> list[str]:
    """Return a page of parameters and residuals."""
    return [*centred(title), nearest(case), "", *parameters, *residual_lines(residuals)]


def residual_lines(residuals: Residuals) -> list[str]:
    """Return the table of residuals with its sums, in micrometres."""
    rows = zip(
        residuals.points.tolist(),
        residuals.xy_um.tolist(),
        residuals.comparator_um.tolist(),
        residuals.grid_um.tolist(),
        strict=True,
    )
    lines = [
        f"{point:7d}{x:15.2f}{y:13.2f}{vx:13.3f}{vy:11.3f}{point:15d}{gx:12.3f}{gy:11.3f}"
        for point, (x, y), (vx, vy), (gx, gy) in rows
    ]
    squares = sums("SUM VV", residuals.squares_um2, 35, 15)
    sigma = sums("SIGMA", residuals.sigma_um, 35, 15)
    unit = f"STANDARD ERROR OF UNIT WEIGHT ={number(residuals.sigma0_um, 9, 4)} MICRONS"
    return [*HEAD, *lines, "", squares, f"  N = {len(residuals.points)}", sigma, "", unit]


def sums(name: str, values: Iterable[float], width: int, gap: int) -> str:
    """Return a line of sums in both systems."""
    x, y, grid_x, grid_y = (number(value, 11, 4) for value in values)
    return f"  {name:<{width}}{x}{y}{'':{gap}}{grid_x}{grid_y}"
