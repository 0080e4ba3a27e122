"""Listing pages of title, readings, pointing precision and averages (figures 5 to 8, 13, 26 to 29)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.comparator.averages import LocationAverages
from photogram.comparator.case import Closeout, exchanged
from photogram.comparator.grid import Grid
from photogram.comparator.listing.parameters import centred, nearest, number, sums
from photogram.comparator.pointing import Precision

if TYPE_CHECKING:
    from photogram.comparator import Calibration, CaseResult, PlateResult

COLUMNS = 3  # Readings per line of the input listing


# Warnings of the program of 1971, which it printed in capitals
PRINTED = frozenset(f"comparators.{name}" for name in ("special-grid", "legs", "identical", "no-closeout"))


def title_page(calibration: Calibration, run_date: str = "") -> list[str]:
    """Return the title page with plates, options and optional problems."""
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
    """Return the original readings of a case, and the close-out."""
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
    """Return the pages on pointing precision."""
    pages = [_case_page(case) for case in calibration.cases]
    for operator, (points, total) in calibration.pointing.operators.items():
        own = [case for case in calibration.cases if case.placed.case.operator == operator]
        title = f"OPERATOR NUMBER {operator} POINTING PRECISION STATISTICS"
        pages.append(_pooled_page(title, points, total, len(own), 1))
    pointing = calibration.pointing
    counts = (len(calibration.cases), len(pointing.operators))
    title = "TOTAL POINTING PRECISION STATISTICS"
    return [*pages, _pooled_page(title, pointing.points, pointing.total, *counts)]


def _case_page(case: CaseResult) -> list[str]:
    placed = case.placed
    title = f"CASE NUMBER {placed.number} POINTING PRECISION STATISTICS"
    rows = [
        _row(f"{readings.point:7d}", readings.precision, *readings.mean_um.tolist())
        for readings in placed.readings
    ]
    return _page(title, rows, placed.precision, f"OPERATOR NUMBER {placed.case.operator}", 1, 1)


def _pooled_page(
    title: str, points: dict[int, Precision], total: Precision, cases: int, operators: int
) -> list[str]:
    rows = [_row(f"{point:7d}", precision) for point, precision in sorted(points.items())]
    return _page(title, rows, total, "", cases, operators)


def _page(
    title: str, rows: Iterable[str], total: Precision, head: str, cases: int, operators: int
) -> list[str]:
    basis = f"{total.points} POINTS, {total.readings} MEASUREMENTS"
    counts = f"({cases} CASES, {operators} OPERATORS)"
    ellipse = (
        f"ERROR ELLIPSE OF A POINTING (39 PERCENT): SEMI-AXES {total.ellipse.major_um:.3f} AND"
        f" {total.ellipse.minor_um:.3f} MICRONS, MAJOR AXIS {math.degrees(total.ellipse.angle_rad):.1f}"
        " DEGREES FROM X TOWARD Y"
        if total.degrees_of_freedom > 0
        else "NO REPEATED READINGS"
    )
    return [
        *centred(title),
        *([head, ""] if head else []),
        *POINTING_HEAD,
        *rows,
        "COMBINED POINT STATISTICS",
        _row("       ", total),
        "",
        f"BASIS / {basis} {counts}",
        ellipse,
    ]


def _row(name: str, own: Precision, mean_x: float | None = None, mean_y: float | None = None) -> str:
    """Return a line of eleven numbers in the order of figure 7."""
    single = "".join(number(value, 9, 3) for value in (*own.sd_um, own.sd_point_um))
    means = "".join(number(value, 13, 2) for value in (mean_x, mean_y))
    of_means = "".join(number(value, 9, 3) for value in (*own.mean_sd_um, own.mean_sd_point_um))
    correlation = number(own.listed_correlation_percent, 10, 2)
    covariance = number(own.covariance_um2, 12, 3)
    return f"{name}{own.readings:8d}{single}{covariance}{correlation}{means}     {of_means}"


AVERAGES_HEAD = [
    f"{'AVERAGE RESIDUALS BY LOCATION':>69}{'AVERAGE RESIDUALS BY POINT':>36}",
    "  POINT         X ADJ        Y ADJ      LOC.          VX         VY          NO.          VX         VY",
]


def averages_page(title: str, result: PlateResult) -> list[str]:
    """Return a page of average residuals of one plate."""
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
