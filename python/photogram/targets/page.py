"""The page of a calibration: that of its block, with the board and the views before it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogram.show.cells import page_table
from photogram.show.page import Facts, Page, Part, Remarks, Section
from photogram.show.ways import page_of
from photogram.targets.calibrated import Calibrated
from photogram.targets.prior_shift import prior_shift
from photogram.targets.tables import board_facts, views, worst_points

__all__ = ["calibration_page"]


@page_of.register(Calibrated)
@np.errstate(over="ignore", invalid="ignore")
def calibration_page(calibrated: Calibrated) -> Page:
    """Return the report of a calibration for the browser."""
    page = page_of(calibrated.snooped or calibrated.result)
    board: list[Part] = [Facts("The board", board_facts(calibrated))]
    if worst := worst_points(calibrated):
        board.append(Remarks(worst))
    table = views(calibrated)
    intro = (
        "Pictures of one view show the board in one pose. chi² is the weighted sum of squares of its corners."
    )
    moved = prior_shift(calibrated)
    sections = [
        Section("board", "Board", board),
        Section("views", "Views", [page_table("Views", table)], intro),
        Section("priors", "Priors of cameras", [page_table("What they have moved", moved)] if moved else []),
    ]
    return replace(page, what="Calibration with targets", sections=[*sections, *page.sections])
