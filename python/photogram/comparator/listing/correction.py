"""The table of nonlinear corrections at fixed places of the comparator (subroutine PLOT, figure 23).

The places depend on the comparator only, so that its calibrations can be compared over the years.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.listing.forms import centred

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.calibration import Calibration, CaseResult
    from photogram.comparator.polynomial import Polynomial

__all__ = ["correction_table", "table_nodes"]

STEP_UM = 25_000.0
"""Distance of the nodes."""
ROWS = 9


def table_nodes(centre_um: float) -> list[Floats]:
    """Return the nodes of the program's table: nine rows of falling x, with nine or five falling y.

    Parameters
    ----------
    centre_um
        Middle of the range of the comparator in x and in y (TRANS); the nodes reach 0.1 m to either side.

    Returns
    -------
    A list of rows, each (9, 2) or (5, 2), in micrometres.
    """
    steps = STEP_UM * np.arange(ROWS // 2, -(ROWS // 2) - 1, -1)
    rows = []
    for row, x in enumerate(steps.tolist()):
        y = steps if row % 2 == 0 else steps[::2]
        rows.append(centre_um + np.column_stack([np.full(len(y), x), y]))
    return rows


def correction_table(calibration: Calibration, case: CaseResult | None = None) -> list[str]:
    """Return the corrections at fixed places: of a case alone, else of the combined adjustment."""
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
        marks = [" " if there else "*" for there in _inside(polynomial, row)]
        outside = outside or "*" in marks
        for axis, head in enumerate((f"X={row[0, 0] / 1e6:7.4f} M.", " " * 12)):
            cells = [f"{value:10.3f}{mark}" for value, mark in zip(values[:, axis], marks, strict=True)]
            lines.append(head + gap.join(cells))
        lines.append("")
    places = "".join(f"{y / 1e6:10.4f} " for y in nodes[0][:, 1])
    lines += [f"Y= (METERS) {places}", "UPPER NUMBER IN X, LOWER NUMBER IN Y"]
    return [*lines, "* OUTSIDE THE RANGE MEASURED"] if outside else lines


def _inside(polynomial: Polynomial, places_um: Floats) -> list[bool]:
    """Say of places (n, 2) whether both coordinates were measured; beyond, the polynomials extrapolate."""
    furthest = np.abs(polynomial.frame.arguments(places_um)).max(axis=1)
    return [distance <= 1 + 1e-9 for distance in furthest.tolist()]
