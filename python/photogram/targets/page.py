"""The page of a calibration: that of its block, with what it is worth, the board and the views before it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram.show.cells import page_table
from photogram.show.page import Document, Drawing, Fact, Facts, Layers, Part, Remarks, Section
from photogram.targets.calibration_difference import CameraDifference
from photogram.targets.calibration_result import Worth
from photogram.targets.drawing import plot_cross_validation, plot_difference, plot_uncertainty
from photogram.targets.grouping import Groups, residual_groups
from photogram.targets.maps import UncertaintyMap, distance_text, map_name
from photogram.targets.residual_drawing import plot_board_residuals, plot_poorest_views
from photogram.targets.tables import board_facts, prior_shift, spline_lines, views, worst_points

if TYPE_CHECKING:
    from photogram.targets import Calibrated


@np.errstate(over="ignore", invalid="ignore")
def calibration_page(calibrated: Calibrated) -> Document:
    """Return the report of a calibration for the browser."""
    page = (calibrated.snooped or calibrated.result).document()
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
        page, what="Calibration with targets", highlights=highlights, sections=[*sections, *page.sections]
    )


def _residuals(calibrated: Calibrated) -> list[Part]:
    """Return tables of residuals by groups, and pictures of them over the board and in the poorest views."""
    drawings = [
        Drawing(
            "board-residuals",
            "On the board",
            "Mean residuals over all views: errors of the print.",
            partial(plot_board_residuals, calibrated),
        ),
        Drawing(
            "poorest-views",
            "Poorest views",
            "Residuals of the pictures that fit worst.",
            partial(plot_poorest_views, calibrated),
        ),
    ]
    tables = [page_table(title, residual_groups(calibrated, by)) for by, title in _GROUPS.items()]
    return [Layers("corner-residuals", drawings), *(each for each in tables if len(each.rows) > 1)]


_GROUPS: dict[Groups, str] = {
    "camera": "By camera",
    "level": "By level of the detector",
    "radius": "By distance from the middle of the picture",
}


CAPTION = (
    "Standard deviation, in the worst direction, of the image of a point that stays fixed to the housing."
    " Dots: corners that were seen; line: their convex hull; dashed, of splined lenses: where knots end."
)
CROSS = (
    "Images of the same points by the second part of the views less those by the first (vectors), and what"
    " that is beside its covariance: about 1 where the covariance explains it."
)
APART = "Where both calibrations image the same points, once the motion between their axes is out."


def worth_facts(worth: Worth) -> list[Fact]:
    """Return the largest standard deviation of each map where the board was seen."""
    return [
        Fact(
            f"{each.camera}, {distance_text(each.distance, each.unit)}",
            f"{each.largest:.2g}",
            "px",
            "largest standard deviation of projection where the board was seen",
        )
        for each in worth.maps
    ]


def worth_section(worth: Worth | None) -> Section:
    """Return the section; it has no parts where nothing was asked."""
    parts: list[Part] = []
    if worth is not None:
        parts += [Remarks(worth.sentences)] if worth.sentences else []
        made = drawings(worth)
        parts += [Layers("uncertainty", made)] if made else []
        parts += [Facts("Cross-validation", facts)] if (facts := _tests(worth)) else []
    return Section("uncertainty", "Uncertainty of projection", parts, CAPTION)


def drawings(worth: Worth) -> list[Drawing]:
    """Return all pictures, still to be drawn."""
    found = [
        Drawing(f"map-{map_name(each)}", _title(each), CAPTION, partial(plot_uncertainty, each))
        for each in worth.maps
    ]
    for cross in worth.cross:
        for own in worth.maps:
            if own.camera in cross.cameras:
                sketch = partial(plot_cross_validation, cross, own)
                name = f"cross-validation-{map_name(own)}"
                found.append(Drawing(name, f"Cross-validation, {_title(own)}", CROSS, sketch))
    return found + [_of_difference(each) for each in worth.differences]


def _tests(worth: Worth) -> list[Fact]:
    found = []
    for cross in worth.cross:
        for (a, b), tests in zip(cross.parts, cross.tests, strict=True):
            for each in tests:
                note = f"chi² of {each.dof}, p {each.probability:.2g}; {len(a)} and {len(b)} views"
                found.append(Fact(each.name, f"{each.chi2:.3g}", "", note, "" if each.explained else "bad"))
    return found


def _of_difference(found: CameraDifference) -> Drawing:
    name = f"difference-{found.cameras[0]}-{found.cameras[1]}".replace(" ", "-")
    return Drawing(name, "Difference", APART, partial(plot_difference, found))


def _title(found: UncertaintyMap) -> str:
    return f"{found.camera} {distance_text(found.distance, found.unit)}"
