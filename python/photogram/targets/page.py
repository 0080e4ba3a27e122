"""The page of a calibration: that of its block, with the board and the views before it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram.plots.panels import figure_of
from photogram.show.cells import page_table
from photogram.show.methods import page_of
from photogram.show.page import Drawing, Facts, Layers, Page, Part, Remarks, Section
from photogram.targets.appraisal_page import worth_facts, worth_section
from photogram.targets.calibration_result import Calibrated
from photogram.targets.grouping import Groups, residual_groups
from photogram.targets.prior_shift import prior_shift
from photogram.targets.residual_drawing import draw_board_residuals, draw_poorest_views
from photogram.targets.splined import spline_lines
from photogram.targets.tables import board_facts, views, worst_points

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    worth = calibrated.worth
    sections = [
        worth_section(worth),
        Section("board", "Board", board),
        Section("views", "Views", [page_table("Views", table)], intro),
        Section("corners", "Residuals of corners", _residuals(calibrated)),
        Section("splines", "Splined lenses", [Remarks(told)] if (told := spline_lines(calibrated)) else []),
        Section("priors", "Priors of cameras", [page_table("What they have moved", moved)] if moved else []),
    ]
    highlights = [*([] if worth is None else worth_facts(worth)), *page.highlights]
    return replace(
        page,
        what="Calibration with targets",
        highlights=highlights,
        sections=[*sections, *page.sections],
    )


def _residuals(calibrated: Calibrated) -> list[Part]:
    """Return tables of residuals by groups, and pictures of them over the board and in the poorest views."""
    figures = {
        "board-residuals": ("On the board", "Mean residuals over all views: errors of the print.", _on_board),
        "poorest-views": ("Poorest views", "Residuals of the pictures that fit worst.", _poorest),
    }
    drawings = [
        Drawing(name, title, caption, partial(draw, calibrated))
        for name, (title, caption, draw) in figures.items()
    ]
    tables = [page_table(title, residual_groups(calibrated, by)) for by, title in _GROUPS.items()]
    return [Layers("corner-residuals", drawings), *(each for each in tables if len(each.rows) > 1)]


_GROUPS: dict[Groups, str] = {
    "camera": "By camera",
    "level": "By level of the detector",
    "radius": "By distance from the middle of the picture",
}


def _on_board(calibrated: Calibrated) -> Figure:
    return figure_of(lambda ax: draw_board_residuals(calibrated, ax=ax))


def _poorest(calibrated: Calibrated) -> Figure:
    return figure_of(lambda ax: draw_poorest_views(calibrated, ax=ax))
