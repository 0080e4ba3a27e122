"""Text listing with the page layout of the 1971 program."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.comparator.averages import LocationAverages
from photogram.comparator.case import Closeout, exchanged
from photogram.comparator.correction import Correction
from photogram.comparator.fits import TERMS, Decomposition, Polynomial, Residuals
from photogram.comparator.grid import Grid
from photogram.comparator.readings import Precision
from photogram.comparator.tables import linear, variance
from photogram.comparator.variance import CombinedPolynomial, SinglePolynomial
from photogram.io.numbers import ARCSEC, degrees_minutes_seconds

if TYPE_CHECKING:
    from photogram.comparator import Calibration, CaseResult, PlateResult


__all__ = ["listing"]

STAGES = {
    "case_linear": "AVERAGE RESIDUALS AFTER INDIVIDUAL LINEAR ADJUSTMENTS",
    "case_nonlinear": "AVERAGE RESIDUALS AFTER INDIVIDUAL LINEAR AND NONLINEAR ADJUSTMENTS",
    "linear": "AVERAGE RESIDUALS AFTER APPLICATION OF FINAL LINEAR CALIBRATION CORRECTIONS",
    "nonlinear": "AVERAGE RESIDUALS AFTER APPLICATION OF ALL FINAL CALIBRATION CORRECTIONS",
}


def listing(calibration: Calibration, run_date: str = "") -> str:
    """Return the listing of a calibration, with form feeds between pages.

    The last page is the report with problems, tests and joint adjustment. If the options request the
    published program, the listing only contains its pages.

    Parameters
    ----------
    calibration
        The calibration.
    run_date
        Text for the run date on the title page; not used elsewhere.
    """
    pages = [title_page(calibration, run_date)]
    pages += [input_page(case) for case in calibration.cases]
    pages += pointing_pages(calibration)
    for case in calibration.cases:
        pages += _case_pages(calibration, case)
    pages += _averages(calibration, "case_linear", "case_nonlinear")
    pages.append(combined_linear_page(calibration))
    pages += [
        residual_page(f"CASE NUMBER {case.number} WITH FINAL LINEAR CORRECTIONS", case, fit.residuals)
        for case, fit in zip(calibration.cases, calibration.linear.cases, strict=True)
    ]
    if calibration.nonlinear:
        pages += [combined_polynomial_page(calibration.nonlinear, len(calibration.cases))]
        pages += [correction_table(calibration)]
        pages += [
            residual_page(f"CASE NUMBER {case.number} WITH ALL FINAL CORRECTIONS", case, fit.residuals)
            for case, fit in zip(calibration.cases, calibration.nonlinear.cases, strict=True)
        ]
    pages += _averages(calibration, "linear", "nonlinear")
    pages.append(summary_page(calibration))
    if not calibration.options.as_published:
        pages.append(calibration.report().splitlines())
    return "\f\n".join("\n".join(line.rstrip() for line in page) + "\n" for page in pages)


def _case_pages(calibration: Calibration, case: CaseResult) -> Iterator[list[str]]:
    name, own, linear = f"CASE NUMBER {case.number}", case.linear.parameters, case.linear
    yield residual_page(f"{name} FREE ADJUSTMENT (ROTATION AND TRANSLATION)", case, case.free.residuals)
    sd = math.sqrt(linear.covariance[3, 3]) / ARCSEC
    rotation = f"  ROTATION {angle(own.rotation_rad)}   SIGMA {sd:8.3f} SEC"
    lines = [*linear_lines(own, linear.covariance), rotation, ""]
    yield residual_page(f"{name} LINEAR ADJUSTMENT", case, linear.residuals, lines)
    if (single := case.polynomial) is not None:
        lines = [*covariance_lines(single), ""]
        yield residual_page(f"{name} NONLINEAR ADJUSTMENT", case, single.residuals, lines)
        if calibration.session.plot_each_case:
            yield correction_table(calibration, case)


def _averages(calibration: Calibration, *stages: str) -> list[list[str]]:
    return [
        averages_page(STAGES[stage], result)
        for stage in stages
        for result in calibration.averages.get(stage, {}).values()
    ]


COLUMNS = 3  # Readings per line of the input listing


# Warnings of the program of 1971, which it printed in capitals
PRINTED = frozenset(f"comparators.{name}" for name in ("special-grid", "legs", "identical", "no-closeout"))


def title_page(calibration: Calibration, run_date: str = "") -> list[str]:
    session = calibration.session
    left_handed = calibration.cases[0].placed.orientation.left_handed
    lines = centred(f"COMPARATOR CALIBRATION - photogram {_photocore.__version__}")
    for plate in calibration.plates:
        lines += _grid(session.grids[plate], left_handed)
    operators = "".join(f"{case.number:4d}" for case in calibration.cases)
    named = "".join(f"{case.placed.case.operator:4d}" for case in calibration.cases)
    stage = " SECONDARY STAGE" if session.secondary else ""
    words = ("NO", "YES")
    settings = [
        ("LEFT HANDED DATA", words[left_handed]),
        ("INPUT DATA IS IN SORT", words[session.sorted_input]),
        ("LEAST COUNT OF ONE MICRON", words[session.least_count_one_micrometre]),
        ("COMPARATOR NUMBER", f"{session.comparator}{stage}"),
        ("CASE", operators),
        ("OPERATOR NUMBER", named),
        ("DATE OF MEASUREMENT", session.date or "-"),
        ("DATE OF RUN", run_date or "-"),
    ]
    lines += [f"  {name:<30}{value}" for name, value in settings]
    if calibration.options.as_published:
        printed = [str(message.text).upper() for message in calibration.messages if message.code in PRINTED]
        return lines + (["", *(f"  {text}" for text in printed)] if printed else [])
    lines += ["", "PROBLEMS"]
    remarks = [line for message in calibration.messages for line in str(message).splitlines()]
    return lines + [f"  {line}" for line in remarks or ["NONE"]]


def _grid(grid: Grid, left_handed: bool) -> list[str]:
    """Return the printed plate coordinates in the handedness of the comparator."""
    sigma = "-" if grid.sigma_um is None else f"{grid.sigma_um:.3f} MICRONS"
    head = f"MASTER GRID NUMBER {grid.number}   VALUES ADOPTED {grid.adopted or '-'}   STANDARD ERROR {sigma}"
    lines = [head, f"  {'POINT':>5}{'X MICRONS':>14}{'Y MICRONS':>14}"]
    rows = zip(grid.points.tolist(), exchanged(grid.xy_um, left_handed).tolist(), strict=True)
    return [*lines, *(f"  {point:5d}{x:14.2f}{y:14.2f}" for point, (x, y) in rows), ""]


def input_page(case: CaseResult) -> list[str]:
    own = case.placed.case
    lines = [f"INPUT DATA CASE ORDER NUMBER {own.number}   PLATE {own.plate}   OPERATOR {own.operator}"]
    lines.append("  " + f"{'LEG':>3}{'POINT':>6}{'X':>12}{'Y':>12}    " * COLUMNS)
    rows = zip(own.legs.tolist(), own.points.tolist(), own.xy_um.tolist(), strict=True)
    cells = [f"{leg:3d}{point:6d}{_reading(x)}{_reading(y)}    " for leg, point, (x, y) in rows]
    height = -(-len(cells) // COLUMNS)
    lines += ["  " + "".join(cells[row::height]) for row in range(height)]
    for closeout in case.closeouts:
        lines += ["", *_closeout(closeout)]
    return [*lines, "", nearest(case)]


def _reading(value: float) -> str:
    return f"{value:12.0f}" if value == round(value) else f"{value:12.2f}"


def _closeout(closeout: Closeout) -> list[str]:
    total = closeout.total_shift_um
    if total is None:
        return ["NO CLOSEOUT MEASUREMENTS ON INITIAL POINT MADE"]
    lines = [f"CHECKS AND CLOSEOUTS ON POINT NUMBER {closeout.point}    (MICRONS)        X         Y"]
    for visit, (x, y) in enumerate(closeout.sequential_shifts_um.tolist(), 2):
        lines.append(f"  SEQUENTIAL SHIFT, VISIT {visit:<24d}{x:8.1f}  {y:8.1f}")
    x, y = total.tolist()
    lines.append(f"  TOTAL CLOSEOUT SHIFT{'':27}{x:8.1f}  {y:8.1f}   {closeout.verdict.upper()}")
    return lines


POINTING_HEAD = [
    "          TIMES     SINGLE OBSERVATION, S.D.      COVA-   CORRE-     MEAN MEASURED COORDINATES     MEAN,"
    " STANDARD DEVIATION",
    "  POINT    READ        X        Y    POINT      RIANCE  LATION %           X            Y             X"
    "        Y    POINT",
]


def pointing_pages(calibration: Calibration) -> list[list[str]]:
    cases, pointing, pages = [case.placed for case in calibration.cases], calibration.pointing, []
    for placed in cases:
        rows = [_row(each.point, each.precision, *each.mean_um.tolist()) for each in placed.readings]
        operator = f"OPERATOR NUMBER {placed.case.operator}"
        pages.append(_page(f"CASE NUMBER {placed.number}", rows, placed.precision, (1, 1), operator))
    count = Counter(placed.case.operator for placed in cases)
    pooled = [(f"OPERATOR NUMBER {k}", *own, (count[k], 1)) for k, own in pointing.operators.items()]
    for title, points, total, counts in (
        *pooled,
        ("TOTAL", pointing.points, pointing.total, (len(cases), len(count))),
    ):
        rows = [_row(point, precision) for point, precision in sorted(points.items())]
        pages.append(_page(title, rows, total, counts))
    return pages


def _page(
    title: str, rows: Iterable[str], total: Precision, counts: tuple[int, int], head: str = ""
) -> list[str]:
    basis = f"{total.points} POINTS, {total.readings} MEASUREMENTS"
    ellipse = (
        f"ERROR ELLIPSE OF A POINTING (39 PERCENT): SEMI-AXES {total.ellipse.major_um:.3f} AND"
        f" {total.ellipse.minor_um:.3f} MICRONS, MAJOR AXIS {math.degrees(total.ellipse.angle_rad):.1f}"
        " DEGREES FROM X TOWARD Y"
        if total.degrees_of_freedom > 0
        else "NO REPEATED READINGS"
    )
    return [
        *centred(f"{title} POINTING PRECISION STATISTICS"),
        *([head, ""] if head else []),
        *POINTING_HEAD,
        *rows,
        "COMBINED POINT STATISTICS",
        _row("", total),
        "",
        "BASIS / {} ({} CASES, {} OPERATORS)".format(basis, *counts),
        ellipse,
    ]


def _row(name: int | str, own: Precision, mean_x: float | None = None, mean_y: float | None = None) -> str:
    """Return a line of eleven numbers in the order of figure 7."""
    single = "".join(number(value, 9, 3) for value in (*own.sd_um, own.sd_point_um))
    means = "".join(number(value, 13, 2) for value in (mean_x, mean_y))
    of_means = "".join(number(value, 9, 3) for value in (*own.mean_sd_um, own.mean_sd_point_um))
    correlation = number(own.listed_correlation_percent, 10, 2)
    covariance = number(own.covariance_um2, 12, 3)
    return f"{name:>7}{own.readings:8d}{single}{covariance}{correlation}{means}     {of_means}"


AVERAGES_HEAD = [
    f"{'AVERAGE RESIDUALS BY LOCATION':>69}{'AVERAGE RESIDUALS BY POINT':>36}",
    "  POINT         X ADJ        Y ADJ      LOC.          VX         VY          NO.          VX         VY",
]


def averages_page(title: str, result: PlateResult) -> list[str]:
    averages, listed = result.averages, result.listed
    first = averages.by_location[0] if averages.by_location else None
    located = dict(zip(first.locations.tolist(), first.residuals_um.tolist(), strict=True)) if first else {}
    rows = zip(averages.points.tolist(), averages.xy_um.tolist(), averages.grid_um.tolist(), strict=True)
    lines = []
    for point, (x, y), (grid_x, grid_y) in rows:
        vx, vy = located.get(point, (math.nan, math.nan))
        lines.append(
            f"{point:7d}{number(x, 15, 2)}{number(y, 13, 2)}{point:10d}{number(vx, 13, 3)}{number(vy, 11, 3)}"
            f"{point:13d}{grid_x:12.3f}{grid_y:11.3f}"
        )
    points = len(averages.points)
    squares = (averages.grid_um**2).sum(axis=0)
    places = len(averages.location_um)
    of_locations = (averages.location_um**2).sum(axis=0) if places else np.full(2, math.nan)
    sigmas = [
        *(math.sqrt(value / (places - 1)) if places else math.nan for value in of_locations),
        *(math.sqrt(value / (points - 1)) for value in squares),
    ]
    random_x, random_y = listed.random_um
    exchange = "X AND Y OF THE PLATE ARE EXCHANGED (LEFT-HANDED)" if averages.left_handed else ""
    return [
        *centred(title),
        f"PLATE {averages.plate}   {len(averages.cases)} CASES   {exchange}",
        "",
        *AVERAGES_HEAD,
        *lines,
        *(line for place in averages.by_location[1:] for line in _elsewhere(place)),
        "",
        sums("SUM VV", (*of_locations, *squares), 45, 14),
        f"  N = {points}" if places in (0, points) else f"  N = {places} LOCATIONS, {points} POINTS",
        sums("SIGMA", sigmas, 45, 14),
        f"  STANDARD DEVIATION{number(listed.mean_comparator_um, 43, 4)}{number(listed.mean_grid_um, 47, 4)}",
        "",
        f"RANDOM ERRORS SIGMA X = {number(random_x, 8, 4)}   SIGMA Y = {number(random_y, 8, 4)}",
        f"UNBIASED GRID STANDARD ERROR = {number(listed.grid_um, 8, 4)}  (LISTING)",
        f"UNBIASED GRID STANDARD ERROR = {number(result.text_um, 8, 4)}  (EQUATION 64)",
        f"UNBIASED GRID STANDARD ERROR = {number(result.unbiased_um, 8, 4)}  (ALL PARAMETERS COUNTED)",
        "",
        "NOTE - GRID CALIBRATION CORRECTIONS ARE VALID ONLY IF ALL AVERAGE RESIDUALS ARE COMPUTED FROM A",
        "       MULTIPLE OF FOUR EXACTLY 90 DEGREE ROTATION CASES.",
    ]


def _elsewhere(place: LocationAverages) -> list[str]:
    """Return the averages by location of cases with another plate position."""
    cases = " ".join(str(case) for case in place.cases)
    rows = zip(place.locations.tolist(), place.xy_um.tolist(), place.residuals_um.tolist(), strict=True)
    return [
        "",
        f"  THE PLATE LAY AT ANOTHER PLACE IN CASES {cases}: THEIR LOCATIONS ARE AVERAGED APART",
        *(
            f"{'':7}{x:15.2f}{y:13.2f}{location:10d}{vx:13.3f}{vy:11.3f}"
            for location, (x, y), (vx, vy) in rows
        ),
    ]


NAMES = ("SCALE X", "SCALE Y", "ALPHA")
LETTERS = "ABCDEFGHJ"
ROWS_OF_AXES = 4  # lines of the analysis of variance with values of both axes


def linear_lines(found: Correction | Decomposition, covariance: Floats) -> list[str]:
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


def combined_linear_page(calibration: Calibration) -> list[str]:
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


def combined_polynomial_page(nonlinear: CombinedPolynomial, cases: int) -> list[str]:
    sigma_x, sigma_y = nonlinear.sigma_um
    return [
        *centred(f"COMBINED NONLINEAR ADJUSTMENT OF {cases} CASES"),
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
        axes = "".join(number(value, 10, 3) for value in values[:2]) if row < ROWS_OF_AXES else ""
        lines.append(f"  {name:<47}{axes:20}{number(values[2], 10, 3)}")
    return lines


WIDTH = 110


def centred(title: str) -> list[str]:
    return [title.center(WIDTH), ""]


def nearest(case: CaseResult) -> str:
    point = case.placed.orientation.nearest_point
    return f"GRID POINT {point} IS NEAREST THE COMPARATOR ORIGIN"


def number(value: float | None, width: int, decimals: int) -> str:
    """Return a number in its field; a missing one as a dash."""
    if value is None or math.isnan(value):
        return "-".rjust(width)
    return f"{value:{width}.{decimals}f}"


def angle(radians: float) -> str:
    degrees, minutes, seconds = degrees_minutes_seconds(radians, 3)
    sign = "-" if radians < 0 and (degrees or minutes or seconds) else " "
    return f"{sign}{degrees:3d} DEG {minutes:2d} MIN {seconds:6.3f} SEC"


def triangle(names: Iterable[str], matrix: Floats) -> list[str]:
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
    count = f"  N = {len(residuals.points)}"
    return [
        *centred(title),
        nearest(case),
        "",
        *parameters,
        *HEAD,
        *lines,
        "",
        squares,
        count,
        sigma,
        "",
        unit,
    ]


def sums(name: str, values: Iterable[float], width: int, gap: int) -> str:
    x, y, grid_x, grid_y = (number(value, 11, 4) for value in values)
    return f"  {name:<{width}}{x}{y}{'':{gap}}{grid_x}{grid_y}"
