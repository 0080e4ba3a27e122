"""Pointing precision: a page for each case, each operator, and all (figures 7, 8 and 13)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from photogram.comparator.listing.forms import centred, number

if TYPE_CHECKING:
    from photogram.comparator.calibration import Calibration, CaseResult
    from photogram.comparator.pointing import Precision

__all__ = ["pointing_pages"]

HEAD = [
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
        f" {total.ellipse.minor_um:.3f} MICRONS, MAJOR AXIS {_degrees(total):.1f} DEGREES FROM X TOWARD Y"
        if total.degrees_of_freedom > 0
        else "NO REPEATED READINGS"
    )
    return [
        *centred(title),
        *([head, ""] if head else []),
        *HEAD,
        *rows,
        "COMBINED POINT STATISTICS",
        _row("       ", total),
        "",
        f"BASIS / {basis} {counts}",
        ellipse,
    ]


def _degrees(precision: Precision) -> float:
    return precision.ellipse.angle_rad * 57.29577951308232


def _row(name: str, own: Precision, mean_x: float | None = None, mean_y: float | None = None) -> str:
    """Return a line of eleven numbers, in the order of figure 7."""
    single = "".join(number(value, 9, 3) for value in (*own.sd_um, own.sd_point_um))
    means = "".join(number(value, 13, 2) for value in (mean_x, mean_y))
    of_means = "".join(number(value, 9, 3) for value in (*own.mean_sd_um, own.mean_sd_point_um))
    correlation = number(own.listed_correlation_percent, 10, 2)
    covariance = number(own.covariance_um2, 12, 3)
    return f"{name}{own.readings:8d}{single}{covariance}{correlation}{means}     {of_means}"
