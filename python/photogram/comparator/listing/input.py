"""Title page, input data and close-out of each case (figures 5 and 6)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram import _photocore
from photogram.comparator.listing.forms import centred, nearest
from photogram.comparator.orientation import exchanged

if TYPE_CHECKING:
    from photogram.comparator.calibration import Calibration, CaseResult
    from photogram.comparator.closeout import Closeout
    from photogram.comparator.grid import Grid

__all__ = ["input_page", "title_page"]

COLUMNS = 3
"""Readings in a line of the input listing."""
ROTATIONS = "EXACTLY 90 DEGREE ROTATION CASES"
"""How the remark ends that stands below the average residuals."""


def title_page(calibration: Calibration, run_date: str = "") -> list[str]:
    """Return the title page: plates, options, and problems where not only published pages are wanted."""
    session = calibration.session
    left_handed = calibration.cases[0].placed.orientation.left_handed
    lines = centred(f"COMPARATOR CALIBRATION - photogram {_photocore.__version__}")
    for plate in calibration.plates:
        lines += _grid(session.grids[plate], left_handed)
    operators = "".join(f"{case.number:4d}" for case in calibration.cases)
    named = "".join(f"{case.placed.case.operator:4d}" for case in calibration.cases)
    stage = " SECONDARY STAGE" if session.secondary else ""
    settings = [
        ("LEFT HANDED DATA", _yes(left_handed)),
        ("INPUT DATA IS IN SORT", _yes(session.sorted_input)),
        ("LEAST COUNT OF ONE MICRON", _yes(session.least_count_one_micrometre)),
        ("COMPARATOR NUMBER", f"{session.comparator}{stage}"),
        ("CASE", operators),
        ("OPERATOR NUMBER", named),
        ("DATE OF MEASUREMENT", session.date or "-"),
        ("DATE OF RUN", run_date or "-"),
    ]
    lines += [f"  {name:<30}{value}" for name, value in settings]
    if calibration.options.pages == "published":
        return lines + _printed(calibration)
    lines += ["", "PROBLEMS"]
    remarks = [line for message in calibration.messages for line in str(message).splitlines()]
    return lines + [f"  {line}" for line in remarks or ["NONE"]]


def _printed(calibration: Calibration) -> list[str]:
    """Return the remarks of the program itself, which are in capitals; that on placements has its page."""
    remarks = [each.text for each in calibration.messages if not each.text.endswith(ROTATIONS)]
    found = [text.upper() for text in remarks if (own := text.split(": ", 1)[-1]) == own.upper()]
    return ["", *(f"  {text}" for text in found)] if found else []


def _yes(value: bool) -> str:
    return "YES" if value else "NO"


def _grid(grid: Grid, left_handed: bool) -> list[str]:
    """Return the coordinates of a plate in the handedness of the comparator, as the program printed them."""
    sigma = "-" if grid.sigma_um is None else f"{grid.sigma_um:.3f} MICRONS"
    head = f"MASTER GRID NUMBER {grid.number}   VALUES ADOPTED {grid.adopted or '-'}   STANDARD ERROR {sigma}"
    lines = [head, f"  {'POINT':>5}{'X MICRONS':>14}{'Y MICRONS':>14}"]
    rows = zip(grid.points.tolist(), exchanged(grid.xy_um, left_handed).tolist(), strict=True)
    return [*lines, *(f"  {point:5d}{x:14.2f}{y:14.2f}" for point, (x, y) in rows), ""]


def input_page(case: CaseResult) -> list[str]:
    """Return the readings of a case as they were made, and the close-out."""
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
    """Return a reading in micrometres, with the decimals that it has."""
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
