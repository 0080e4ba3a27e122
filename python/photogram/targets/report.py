"""The report of a calibration as text: that of its block, with the board and the views behind the summary."""

from __future__ import annotations

import numpy as np

from photogram.results.network_tables import points
from photogram.results.report import details, summary
from photogram.show.lines import fact_lines, field, table_lines
from photogram.show.methods import report_of
from photogram.show.quantity import Quantity
from photogram.show.sections import Section, composed, headline
from photogram.targets.calibration_result import Calibrated
from photogram.targets.tables import board_facts, moved_lines, spline_lines, views, worst_points

TITLE = "calibration with targets"
ON_TOP = 2
"""Sections of what snooping says that every summary has: the verdict, and what to do next."""


@report_of.register(Calibrated)
@np.errstate(over="ignore")
def report(calibrated: Calibrated) -> str:
    """Return the report of a calibration."""
    block = [
        (title, _held_points(calibrated) or lines if title == "Points" else lines)
        for title, lines in details(calibrated.result)
    ]
    return composed(headline(TITLE), [*calibration_summary(calibrated), *block])


def _held_points(calibrated: Calibrated) -> list[str]:
    """Return a line of the points of a board that is held; none of other boards."""
    if calibrated.calibration.shape != "held":
        return []
    *_, rays, _, _ = points(calibrated.result)
    few, many = int(np.min(rays.values)), int(np.max(rays.values))
    pictures = f"{few}" if few == many else f"{few} to {many}"
    return [f"{len(rays.values)} points of the board, held, in {pictures} pictures each"]


def calibration_summary(calibrated: Calibrated) -> list[Section]:
    """Return what a reader wants first: the summary of the block, the board, its views."""
    worth = calibrated.worth
    return [
        ("Uncertainty of projection", [] if worth is None else worth.sentences),
        *summary(calibrated.result),
        *([] if calibrated.snooped is None else calibrated.snooped.sections()[ON_TOP:]),
        ("Board", [*fact_lines(board_facts(calibrated)), *worst_points(calibrated)]),
        ("Splined lenses", spline_lines(calibrated)),
        ("What the priors of cameras have moved", moved_lines(calibrated)),
        ("Views", _views(views(calibrated))),
    ]


def _views(table: list[Quantity]) -> list[str]:
    forms = {"rms_px": ".3f", "redundancy": ".1f", "chi2": ".1f", "largest_standardized": ".2f"}
    heads = {"left_out": "left out", "largest_standardized": "largest w", "rms_px": "rms px"}
    fields = field(table[0], 4, head="view")
    for each in table[1:]:
        name = str(each.name)
        fields += field(each, 12, forms.get(name, ".0f"), head=heads.get(name, name))
    return table_lines(fields)
