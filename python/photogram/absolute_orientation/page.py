"""The page of an absolute orientation."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from photogram.absolute_orientation.orientation import Orientation
from photogram.absolute_orientation.plot import residuals_sketch
from photogram.absolute_orientation.tables import (
    cycles,
    facts,
    left_out,
    parameters,
    points,
    rotation,
    tested_control,
)
from photogram.show.cells import page_table
from photogram.show.judgement import judged, remarks_section, tests_section
from photogram.show.methods import page_of
from photogram.show.page import Document, Drawing, Fact, Facts, Part, Section, significant
from photogram.show.quantity import chosen, long

LISTED = 300
"""Transformed points that are listed at most."""


@page_of.register(Orientation)
def orientation_page(result: Orientation) -> Document:
    """Return the report of an orientation for the browser."""
    stations, (much, good) = result.stations, facts(result)
    own = parameters(result)
    _, _, known, freedom = much[1:]
    tables: list[Part] = [
        page_table("Parameters", own, by=own[2].values),
        page_table("Rotation matrix A", [rotation(result)]),
    ]
    sections = [
        Section("residuals", "Residuals in plan", [_drawing(result)]),
        Section("parameters", "Parameters", tables, "x = s A X + B, from the ground to the model."),
        Section("control", "Control", [page_table("Control", tested_control(result))], _tested(result)),
        Section("left-out", "Control that took no part", _left_out(result)),
        Section("size", "How much, how good", [Facts("How much", much), Facts("How good", good)]),
        tests_section(result.verdict),
        Section("points", "Transformed points", _points(result)),
        Section("iterations", "Iterations", [page_table("Iterations", cycles(result))]),
        remarks_section(result.problems),
    ]
    unit = f"{stations.model_unit} / {stations.ground_unit}"
    return Document(
        what="Absolute orientation of a model",
        title="",
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
        highlights=[good[0], Fact("Scale", significant(result.similarity.scale, 6), unit), known, freedom],
        sections=sections,
    )


def _drawing(result: Orientation) -> Drawing:
    caption = "The control in plan with its residuals, given minus transformed, enlarged as the scale says."
    sketch = partial(residuals_sketch, result)
    return Drawing("picture-residuals", "Residuals of the control in plan", caption, sketch)


def _tested(result: Orientation) -> str:
    if not math.isfinite(result.limit):
        return "Given minus transformed. No single coordinate is tested: it takes two degrees of freedom."
    tests = int(np.isfinite(result.tested).sum())
    return (
        f"Given minus transformed, in the system of the ground. Beyond {result.limit:.2f} the test of a"
        f" coordinate rejects (5 percent for all {tests} together)."
    )


def _left_out(result: Orientation) -> list[Part]:
    table = left_out(result)
    places = np.argwhere(np.isfinite(table[1].values))
    return [page_table("Control that took no part", long(table, places))] if len(places) else []


def _points(result: Orientation) -> list[Part]:
    table = points(result)
    count, sd = len(table[0].values), table[2].values
    if not count:
        return []
    note = "" if count <= LISTED else f"The first {LISTED} of {count}."
    shown = chosen(table, np.arange(min(count, LISTED)))
    return [page_table("Transformed points", shown, note, sd)]
