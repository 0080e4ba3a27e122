"""Document of a plan of views."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram.lazy_dataclasses import replace
from photogram.network.attitudes import Attitudes
from photogram.network.hull import hull
from photogram.show.page import Document, Drawing, Judgement, Layers, Section, Tone
from photogram.show.quantity import Axis, Quantity, Table, of_each
from photogram.show.sketch.marks import Mark, Markers, Panel, Polygons, boxes
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, FAINT, VERMILION
from photogram.targets.drawing import in_pixels
from photogram.targets.page import drawings, worth_facts, worth_members

if TYPE_CHECKING:
    from photogram.targets import ViewPlan


CAPTION = "Where the corners of the board are in each picture; red: its point 0."
PREDICTED = "This is a plan: the standard deviations follow from the planned board poses only."


def document(plan: ViewPlan) -> Document:
    """Return the document of a plan."""
    calibration, worth = plan.calibrated.calibration, plan.calibrated.worth
    assert worth is not None
    tone: Tone = "good" if plan.need and plan.enough else "" if plan.enough else "bad"
    views = Drawing("planned-views", "Views", CAPTION, partial(plot_planned_views, plan))
    maps = Layers("uncertainty", [views, *drawings(worth)])
    return Document(
        what="Plan of views of a board",
        title="",
        judgements=[Judgement("Plan", plan.headline, [PREDICTED, *plan.assumed], tone)],
        advice=plan.next,
        highlights=worth_facts(worth),
        sections=[
            Section.of(_views(plan)),
            Section("uncertainty", "Uncertainty of projection", [maps]),
            Section.of(_parameters(plan)),
        ],
        members={
            "board": calibration.board.described,
            "size": calibration.corners.sizes[0],
            "model": calibration.cameras[0].model,
            "sd_of_corners": calibration.sd0,
            "distance": plan.distance if math.isfinite(plan.distance) else None,
            "need": plan.need or None,
            "enough": plan.enough,
            "largest": plan.largest,
            "maps": worth_members(worth)["maps"],
        },
    )


def _parameters(plan: ViewPlan) -> Table:
    camera, nominal = plan.calibrated.cameras[0], plan.calibrated.calibration.cameras[0]
    free = camera.estimated
    columns = [
        Quantity(np.array(camera.names, dtype=object)[free], (), "name", member="name", head="Parameter"),
        Quantity(nominal.values[free], member="nominal", head="Nominal", figures=6),
        Quantity(camera.sd[free], member="sd", head="Standard deviation", figures=2),
    ]
    return Table("parameters", "Camera", columns)


def _views(plan: ViewPlan) -> Table:
    poses = np.array([view.candidate.pose for view in plan.views])
    turns = Attitudes.of("matrix_to_vision", poses[:, :3, :3]).values("rotation_vector_to_vision")
    unit, pixels = plan.calibrated.calibration.board.unit, (Axis.of("px", "px"),)
    columns = [
        Quantity(np.arange(1, len(poses) + 1), name="view", member="view", head="View"),
        of_each(plan.views, "candidate.name", (), "name", name="board", member="board", head="Board"),
        of_each(plan.views, "corners", name="corners", head="Corners"),
        of_each(
            plan.views, "largest", pixels, "value", name="largest_px", member="largest_px", head="Largest"
        ),
        Quantity(turns, tuple(Axis.of(f"r{axis}", "") for axis in "xyz"), name=""),
        Quantity(poses[:, :3, 3], tuple(Axis.of(f"t{axis}", unit) for axis in "xyz"), "value", ""),
        Quantity(poses, member="pose"),
    ]
    about = "Largest is the largest standard deviation over the picture with this view and those before it."
    return Table("views", "Views to take", columns, about=about)


__all__ = ["plot_planned_views"]

PANELS_PER_ROW, PANEL_INCHES = 4, 2.2


def plot_planned_views(plan: ViewPlan) -> Plot:
    """Plot the corners of the planned board views in the image, with point 0 in red.

    Parameters
    ----------
    plan
        Plan of views.
    """
    corners = plan.calibrated.calibration.corners
    (size,) = corners.sizes
    assert size is not None
    rows = -(-len(plan.views) // PANELS_PER_ROW)
    panels = list[Panel]()
    for number in range(len(plan.views)):
        own = corners.xy[corners.picture == number]
        panel = in_pixels(size)
        marks: list[Mark] = [
            Polygons(boxes(panel.limits[:1], panel.limits[1:]), "white", 1.0, FAINT, 1.0, 1.6),
            Polygons(hull(own)[np.newaxis], FAINT, 0.5, BLUE, 0.5, 1.0),
            Markers(own, ".", 2.5, BLUE),
        ]
        if corners.point[corners.picture == number][0] == 0:
            marks.append(Markers(own[:1], "o", 5.0, VERMILION))
        panels.append(replace(panel, marks=marks, title=f"{number + 1}", across="", up="", bare=True))
    every = [*panels, *[None] * (rows * PANELS_PER_ROW - len(panels))]
    return Plot(
        PANEL_INCHES * PANELS_PER_ROW, rows * (0.3 + PANEL_INCHES * size[1] / size[0]), every, PANELS_PER_ROW
    )
