"""The page of a run through a deck of grid measurements."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from photogram.perspective_center.batch import Run
from photogram.perspective_center.plot import figure
from photogram.perspective_center.solution import INTERIOR, PerspectiveCenter
from photogram.show.judgement import judged, remarks_section
from photogram.show.page import (
    Cell,
    Column,
    Drawing,
    Fact,
    Judgement,
    Layers,
    Page,
    Part,
    Row,
    Section,
    Table,
    decimals_of,
    significant,
)
from photogram.show.ways import page_of

__all__ = ["run_page"]


@page_of.register(Run)
def run_page(run: Run) -> Page:
    """Return the report of a run for the browser."""
    sections = [
        Section("residuals", "Residuals and distortion", [_drawing(run)] if run.results else []),
        _layers("parameters", "Perspective centre and attitude", run, _parameters, _PARAMETERS),
        _layers("points", "Points", run, _points, _POINTS),
        _layers("iterations", "Iterations", run, _iterations, ""),
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
    return Drawing("picture-grid", "Residuals and distortion", caption, lambda: figure(run.results))


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
    names = ("X", "Y", "Z", "omega, ′", "phi, ′", "kappa, ′")
    errors = np.full(6, np.nan) if result.standard_errors is None else result.standard_errors
    values = [*result.position, *result.attitude_minutes]
    rows: list[Row] = [
        [name, Cell(f"{value:.{decimals_of(np.array([error]))}f}", sorts=float(value)), float(error)]
        for name, value, error in zip(names, values, errors, strict=True)
    ]
    errors_of = dict(
        zip(result.unknown, () if result.interior_errors is None else result.interior_errors, strict=False)
    )
    for name, value in zip(INTERIOR, result.interior, strict=True):
        if name in result.unknown:
            rows.append(
                [
                    f"{name}, mm",
                    Cell(f"{value:.4f}", sorts=float(value)),
                    float(errors_of.get(name, math.nan)),
                ]
            )
    grid = result.grid
    how = "as published" if result.as_published else "least squares"
    note = (
        f"{len(grid.ids)} points, {int(grid.readings.sum())} readings, {how}, {len(result.cycles)} iterations"
    )
    columns = (Column("Unknown", text=True), Column("Value"), Column("Standard error", figures=3))
    return Table(_name(result), columns, rows, note)


def _points(result: PerspectiveCenter) -> Table:
    beyond = set(result.outliers)
    rows: list[Row] = [
        [
            str(name),
            int(result.grid.readings[k]),
            *map(float, result.residual[k]),
            1000.0 * float(result.radial_distortion[k]),
            *map(float, result.redundancy[k]),
            *(
                Cell(float(result.studentized[k, axis]), tone="look" if (k, axis) in beyond else "")
                for axis in (0, 1)
            ),
        ]
        for k, name in enumerate(result.grid.ids)
    ]
    columns = [
        Column("Point", text=True),
        Column("Readings"),
        *(Column(f"Residual {axis}", decimals=4) for axis in "XY"),
        Column("Radial distortion", "µm", decimals=1),
        *(Column(f"Redundancy {axis}", decimals=3) for axis in "XY"),
        *(Column(f"t {axis}", decimals=2) for axis in "XY"),
    ]
    note = f"Beyond {result.limit:.2f} the test rejects." if math.isfinite(result.limit) else ""
    return Table(_name(result), columns, rows, note)


def _iterations(result: PerspectiveCenter) -> Table:
    columns = [
        Column("Cycle"),
        *(Column(axis, decimals=5) for axis in "XYZ"),
        *(Column(f"Correction {axis}", figures=3) for axis in "XYZ"),
    ]
    rows: list[Row] = [
        [k, *map(float, each.position), *map(float, each.correction[:3])]
        for k, each in enumerate(result.cycles, 1)
    ]
    return Table(_name(result), columns, rows)
