"""The page of a run through a deck of grid measurements."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from photogram.perspective_center.batch import Run
from photogram.perspective_center.plot import run_sketch
from photogram.perspective_center.report import cycles, points, size_of, unknowns
from photogram.perspective_center.solution import PerspectiveCenter
from photogram.show.cells import page_table
from photogram.show.judgement import judged, remarks_section
from photogram.show.methods import page_of
from photogram.show.page import Drawing, Fact, Judgement, Layers, Page, Part, Section, Table, significant


@page_of.register(Run)
def run_page(run: Run) -> Page:
    """Return the report of a run for the browser."""
    sections = [
        Section("residuals", "Residuals and distortion", [_drawing(run)] if run.results else []),
        _layers("parameters", "Perspective centre and attitude", run, _parameters, _PARAMETERS),
        _layers("points", "Points", run, _points, _POINTS),
        _layers("iterations", "Iterations", run, lambda each: page_table(_name(each), cycles(each)), ""),
        remarks_section(run.messages),
    ]
    judgements = [judged(each.verdict, _name(each)) for each in run.results]
    if run.stop is not None:
        judgements.append(Judgement("Stopped", str(run.stop.error), (), "bad", f"set {run.stop.number}"))
    return Page(
        what="Perspective centre of a projector",
        title=run.results[0].grid.title if run.results else "",
        judgements=judgements,
        advice=list(dict.fromkeys(each for one in run.results for each in one.verdict.next)),
        highlights=[fact for each in run.results for fact in _highlights(each)],
        sections=sections,
    )


_PARAMETERS = "In the unit of the model, angles in minutes of arc; standard errors from the residuals."
_POINTS = (
    "Measured minus projected, in the unit of the model; radial distortion on the plate, positive outward."
    " The test value is the residual over its own standard deviation, from all other points (Student)."
)


def _name(result: PerspectiveCenter) -> str:
    return f"Set {result.grid.number}, Z = {result.grid.model[:, 2].mean():g}"


def _drawing(run: Run) -> Drawing:
    caption = "Left the residuals of the grid, enlarged alike in all sets; right the radial distortion."
    return Drawing("picture-grid", "Residuals and distortion", caption, partial(run_sketch, run.results))


def _layers(
    name: str, title: str, run: Run, table: Callable[[PerspectiveCenter], Table], intro: str
) -> Section:
    tables = [table(each) for each in run.results]
    parts: list[Part] = [Layers(f"{name}-layers", tables)] if len(tables) > 1 else [*tables]
    return Section(name, title, parts, intro)


def _highlights(result: PerspectiveCenter) -> list[Fact]:
    name = _name(result)
    if result.sigma0_plate is None:
        return [Fact(name, "–", note="no redundancy: no standard errors")]
    largest = 1000.0 * max(result.radial_distortion, key=abs)
    note = f"largest radial distortion {largest:+.1f} µm"
    return [
        Fact(f"Standard error on the plate, {name}", significant(1000.0 * result.sigma0_plate, 3), "µm", note)
    ]


def _parameters(result: PerspectiveCenter) -> Table:
    table = unknowns(result)
    return page_table(_name(result), table, size_of(result), table[2].values)


def _points(result: PerspectiveCenter) -> Table:
    note = f"Beyond {result.limit:.2f} the test rejects." if math.isfinite(result.limit) else ""
    return page_table(_name(result), points(result), note)
