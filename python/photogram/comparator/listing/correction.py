"""The table of nonlinear corrections (subroutine PLOT, figure 23)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.comparator.correction_table import table_nodes, table_values
from photogram.comparator.listing.forms import centred

if TYPE_CHECKING:
    from photogram.comparator.calibration import Calibration, CaseResult

__all__ = ["correction_table"]


def correction_table(calibration: Calibration, case: CaseResult | None = None) -> list[str]:
    """Return the corrections over the measured range: of a case alone, else of the combined adjustment."""
    source = case.polynomial if case else calibration.nonlinear
    if source is None:
        return []
    polynomial = source.polynomial
    frame = polynomial.frame
    nodes = table_nodes(frame.centre_um, max(frame.half_range_um))
    whose = f"CASE NUMBER {case.number}" if case else f"{len(calibration.cases)} CASES"
    lines = centred(f"NONLINEAR CORRECTIONS, {whose} (MICRONS)")
    for row, values in zip(nodes, table_values(polynomial, nodes), strict=True):
        gap = "" if len(row) == len(nodes) else " " * 11
        lines.append(f"X={row[0, 0] / 1e6:7.4f} M." + gap.join(f"{value:11.3f}" for value in values[:, 0]))
        lines.append(" " * 12 + gap.join(f"{value:11.3f}" for value in values[:, 1]))
        lines.append("")
    places = "".join(f"{y / 1e6:11.4f}" for y in nodes[0][:, 1])
    return [*lines, f"Y= (METERS) {places}", "UPPER NUMBER IN X, LOWER NUMBER IN Y"]
