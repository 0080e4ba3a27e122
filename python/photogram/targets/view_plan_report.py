"""How a plan of views is shown: its report, its page, its JSON document, its files."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from photogram.io import json
from photogram.io.csv_text import csv_text
from photogram.network.attitudes import Attitudes
from photogram.show.cells import page_table
from photogram.show.lines import field, table_lines
from photogram.show.methods import document_of, page_of, report_of
from photogram.show.page import Document, Drawing, Judgement, Layers, Section, Tone
from photogram.show.quantity import Axis, Quantity, frame, records
from photogram.show.sections import Section as Lines
from photogram.show.sections import composed, headline
from photogram.targets.document import worth_files, worth_members
from photogram.targets.maps import distance_text
from photogram.targets.page import drawings, worth_facts
from photogram.targets.plan_drawing import plot_planned_views
from photogram.targets.view_plan_result import ViewPlan

CAPTION = "Where the corners of the board are in each picture; red: its point 0."
NOTHING = "No picture has been taken: standard deviations follow from where the board is held alone."
_PIXELS = (Axis.of("px", "px"),)


@report_of.register(ViewPlan)
def report(plan: ViewPlan) -> str:
    """Return the plan as text."""
    return composed(headline("plan of views of a board"), plan_sections(plan))


def plan_sections(plan: ViewPlan) -> list[Lines]:
    """Return what a reader wants to know of a plan, section by section."""
    unit = plan.calibrated.calibration.board.unit
    shown = ", ".join(f"{each.largest:.2g} px {distance_text(each.distance, unit)}" for each in plan.maps)
    name, value, sd = camera(plan)
    lens = [*field(name, 12), *field(value, 14, ".6g", head="nominal"), *field(sd, 12, ".2g", head="sd")]
    return [
        ("Plan", [f"{plan.headline}.", f"Worst where the board is shown: {shown}.", *plan.assumed]),
        ("Views to take", [f"{number:>3}  {said}" for number, said in enumerate(plan.sentences, 1)]),
        ("Camera", table_lines(lens)),
        ("What to do next", list(plan.next)),
    ]


def camera(plan: ViewPlan) -> list[Quantity]:
    """Return the parameters that a calibration would find: name, nominal value, predicted deviation."""
    own, given = plan.calibrated.cameras[0], plan.calibrated.calibration.cameras[0]
    free = own.estimated
    names = np.array(own.names, dtype=object)[free]
    return [
        Quantity(names, (), "name", "parameter", "name", head="Parameter"),
        Quantity(given.values[free], (), "number", "nominal", "nominal", head="Nominal", figures=6),
        Quantity(own.sd[free], (), "number", "sd", "sd", head="Standard deviation", figures=2),
    ]


def views(plan: ViewPlan) -> list[Quantity]:
    """Return the views: where the board is held, corners, largest standard deviation with it, poses."""
    poses = np.array([each.candidate.pose for each in plan.views])
    turns = Attitudes.of("matrix_to_vision", poses[:, :3, :3]).values("rotation_vector_to_vision")
    unit = plan.calibrated.calibration.board.unit
    names = np.array([each.candidate.name for each in plan.views], dtype=object)
    corners = np.array([each.corners for each in plan.views])
    largest = np.array([each.largest for each in plan.views])
    return [
        Quantity(np.arange(1, len(names) + 1), (), "number", "view", "view", head="View"),
        Quantity(names, (), "name", "board", "board", head="Board"),
        Quantity(corners, (), "number", "corners", "corners", head="Corners"),
        Quantity(largest, _PIXELS, "value", "largest_px", "largest_px", head="Largest"),
        Quantity(turns, tuple(Axis.of(f"r{axis}", "") for axis in "xyz"), "number", ""),
        Quantity(poses[:, :3, 3], tuple(Axis.of(f"t{axis}", unit) for axis in "xyz"), "value", ""),
        Quantity(poses, member="pose"),
    ]


@page_of.register(ViewPlan)
def page(plan: ViewPlan) -> Document:
    """Return the plan for the browser."""
    worth = plan.calibrated.worth
    assert worth is not None
    tone: Tone = "good" if plan.need and plan.enough else "" if plan.enough else "bad"
    return Document(
        what="Plan of views of a board",
        title="",
        judgements=[Judgement("Plan", plan.headline, [NOTHING, *plan.assumed], tone)],
        advice=plan.next,
        highlights=worth_facts(worth),
        sections=[
            Section("views", "Views to take", [page_table("Views", views(plan))], " ".join(plan.assumed)),
            Section("uncertainty", "Uncertainty of projection", [Layers("uncertainty", plan_drawings(plan))]),
            Section("camera", "Camera", [page_table("Parameters", camera(plan))]),
        ],
    )


def plan_drawings(plan: ViewPlan) -> list[Drawing]:
    """Return all pictures, still to be drawn: the views, and maps of the uncertainty that they promise."""
    worth = plan.calibrated.worth
    assert worth is not None
    return [Drawing("planned-views", "Views", CAPTION, partial(plot_planned_views, plan)), *drawings(worth)]


@document_of.register(ViewPlan)
def document(plan: ViewPlan) -> bytes:
    """Return the plan as JSON (UTF-8)."""
    calibration, worth = plan.calibrated.calibration, plan.calibrated.worth
    assert worth is not None
    return json.to_json(
        {
            "board": calibration.board.described,
            "size": calibration.corners.sizes[0],
            "model": calibration.cameras[0].model,
            "sd_of_corners": calibration.sd0,
            "distance": plan.distance if math.isfinite(plan.distance) else None,
            "need": plan.need or None,
            "enough": plan.enough,
            "largest": plan.largest,
            "parameters": records(camera(plan)),
            "views": records(views(plan)),
            "maps": worth_members(worth)["maps"],
        }
    )


def plan_files(plan: ViewPlan) -> dict[str, bytes]:
    """Return what goes to the directory of a plan, by names: report, views, maps."""
    worth = plan.calibrated.worth
    assert worth is not None
    return {
        "report.txt": plan.report().encode(),
        "views.csv": csv_text(frame(views(plan))),
        **worth_files(worth),
    }
