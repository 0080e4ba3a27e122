"""The table of nonlinear corrections (subroutine PLOT, figure 23)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.comparator.correction_table import inside, table_nodes, table_values
from photogram.comparator.listing.forms import centred

if TYPE_CHECKING:
    from photogram.comparator.calibration import Calibration, CaseResult

__all__ = ["correction_table"]


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
    for row, values in zip(nodes, table_values(polynomial, nodes), strict=True):
        gap = "" if len(row) == len(nodes) else " " * 11
        marks = [" " if there else "*" for there in inside(polynomial, row)]
        outside = outside or "*" in marks
        for axis, head in enumerate((f"X={row[0, 0] / 1e6:7.4f} M.", " " * 12)):
            cells = [f"{value:10.3f}{mark}" for value, mark in zip(values[:, axis], marks, strict=True)]
            lines.append(head + gap.join(cells))
        lines.append("")
    places = "".join(f"{y / 1e6:10.4f} " for y in nodes[0][:, 1])
    lines += [f"Y= (METERS) {places}", "UPPER NUMBER IN X, LOWER NUMBER IN Y"]
    return [*lines, "* OUTSIDE THE RANGE MEASURED"] if outside else lines
