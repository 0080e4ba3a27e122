"""The document of a run through a deck; tables of several sets are layers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import replace
from photogram.messages import Message, listed
from photogram.perspective_center.plot import run_sketch, set_name
from photogram.perspective_center.solution import INTERIOR, PerspectiveCenter
from photogram.show.forms import record
from photogram.show.judgement import judged, remarks_section
from photogram.show.page import Document, Drawing, Fact, Judgement, Section, layered, significant
from photogram.show.quantity import Axis, Quantity, Table, column, component, members

PLACE = tuple(map(Axis, "XYZ"))
ANGLES = tuple(Axis.of(name, "arcmin") for name in ("omega", "phi", "kappa"))
OUTWARD = (Axis("", "mm", small="um", factor=1000.0),)
ERRORS = ("X", "Y", "Z", "omega_minutes", "phi_minutes", "kappa_minutes")
UNITS = {
    "perspective_center": "unit of the model",
    "attitude_minutes": "omega, phi, kappa in minutes of arc, 3437.7468 to the radian",
    "standard_errors": "unit of the model; minutes of arc",
    "sigma0_plate": "mm",
    "sigma0_model": "unit of the model",
    "covariance": "omega, phi, kappa in rad, X, Y, Z in the unit of the model, mm; products",
    "interior": "principal distance c, principal point xp, yp, mm; errors of the unknown ones",
    "mean": "unit of the model",
    "residual": "measured minus projected, unit of the model",
    "radial_distortion": "mm on the plate, positive outward",
    "standardized": "residual / its own standard deviation, from sigma0_plate",
    "studentized": "residual / its own standard deviation, from that of all others: Student",
}


def run_document(
    results: Sequence[PerspectiveCenter], messages: Sequence[Message], stop: Judgement | None
) -> Document:
    """Return the document of the sets of a run, with warnings and stop reason."""
    sets = [set_document(result) for result in results]
    values = {
        "units": UNITS,
        "messages": [*map(str, messages)],
        "error": stop and stop.headline,
        "sets": [*map(record, sets)],
    }
    title = sets[0].what if sets else ""
    run = layered("Perspective centre of a projector", title, sets, members=values)
    caption = "Left the residuals of the grid, enlarged alike in all sets; right the radial distortion."
    drawing = Drawing("picture-grid", "Residuals and distortion", caption, partial(run_sketch, results))
    picture = Section("residuals", drawing.title, [drawing] if sets else [])
    return replace(
        run,
        judgements=[*run.judgements, *([stop] if stop else [])],
        sections=[picture, *run.sections, remarks_section(messages)],
    )


def set_document(result: PerspectiveCenter) -> Document:
    """Return the document of a set."""
    grid, outliers = result.grid, [(result.grid.ids[row], "XY"[axis]) for row, axis in result.outliers]
    errors = np.full(6 + len(result.unknown), np.nan)
    if result.standard_errors is not None and result.interior_errors is not None:
        errors = np.array([*result.standard_errors, *result.interior_errors])
    of_interior = () if result.covariance is None else zip(result.unknown, errors[6:], strict=True)
    numbers = {
        **members(grid, "title", data_set="number"),
        **members(result, "attitude_minutes", "sigma0_plate", "sigma0_model", "covariance", "converged"),
        "perspective_center": result.position,
        "standard_errors": dict(zip(ERRORS, errors, strict=False)),
        "interior": dict(zip(INTERIOR, result.interior, strict=True)),
        "interior_standard_errors": dict(of_interior),
        "test": {"of": "studentized", "limit": result.limit, "outliers": outliers},
        "verdict": result.verdict.document(),
        "iterations": len(result.cycles),
    }
    tables = [_parameters(result, errors), _points(result), _iterations(result)]
    return Document(
        what=grid.title or "",
        title=set_name(result),
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
        highlights=_highlights(result),
        sections=[*map(Section.of, tables)],
        members=numbers,
    )


def _highlights(result: PerspectiveCenter) -> list[Fact]:
    if result.sigma0_plate is None or result.sigma0_model is None:
        return [Fact("Standard error on the plate", "–", note="no redundancy: no standard errors")]
    plate, largest = 1000.0 * result.sigma0_plate, 1000.0 * max(result.radial_distortion, key=abs)
    model = f"{significant(result.sigma0_model, 3)} in the model; largest radial distortion {largest:+.1f} µm"
    beyond = [(*place, result.studentized[place]) for place in result.outliers]
    names = [f"{result.grid.ids[row]} {'XY'[axis]} ({t:+.2f})" for row, axis, t in beyond]
    test = f"studentized residuals beyond {result.limit:.2f}: {listed(names) or 'none'}"
    if not math.isfinite(result.limit):
        test = "no test of single residuals: it takes two degrees of freedom"
    return [
        Fact.of("Standard error on the plate", plate, "µm", model, figures=3),
        Fact("Readings beyond the limit", str(len(names)), "", test, "look" if names else ""),
    ]


def _parameters(result: PerspectiveCenter, errors: Floats) -> Table:
    axes = (*PLACE, *ANGLES, *(Axis.of(name, "mm") for name in result.unknown))
    interior = result.interior[[INTERIOR.index(name) for name in result.unknown]]
    values, of = np.array([*result.position, *result.attitude_minutes, *interior]), np.arange(len(axes))
    columns = [
        component(axes, of)[0],
        Quantity(values, axes, "value", "value", head="Value", figures=10, of=of),
        Quantity(errors, axes, "deviation", "standard_error", head="Standard error", of=of),
    ]
    grid, how = result.grid, "as published" if result.as_published else "least squares"
    readings = f"{len(grid.ids)} points, {grid.readings.sum()} readings"
    note = f"{readings}, {how}, {len(result.cycles)} iterations"
    about = "In the unit of the model, angles in minutes of arc; standard errors from the residuals."
    return Table("parameters", "Perspective centre and attitude", columns, note, about, errors)


def _points(result: PerspectiveCenter) -> Table:
    grid, plan, radial = result.grid, PLACE[:2], result.radial_distortion
    beyond = np.abs(result.studentized) > result.limit
    columns = [
        Quantity(np.array(grid.ids, dtype=object), (), "name", "id", "id", head="Point"),
        column("readings", grid.readings, "Readings"),
        Quantity(grid.model[:, :2], plan, "value", "mean", "mean"),
        column("residual", result.residual, "Residual {}", axes=plan, kind="deviation", decimals=4),
        column("radial_distortion", radial, "Radial distortion", axes=OUTWARD, kind="deviation", decimals=1),
        column("redundancy", result.redundancy, "Redundancy {}", axes=plan, decimals=3),
        column("standardized", result.standardized, axes=plan),
        column("studentized", result.studentized, "t {}", axes=plan, decimals=2, marked=beyond),
    ]
    note = f"Beyond {result.limit:.2f} the test rejects." if math.isfinite(result.limit) else ""
    about = (
        "Measured minus projected, in the unit of the model; radial distortion on the plate, positive"
        " outward. The test value is the residual over its own standard deviation, from all other points"
        " (Student)."
    )
    return Table("points", "Points", columns, note, about)


def _iterations(result: PerspectiveCenter) -> Table:
    positions = np.reshape([each.position for each in result.cycles], (-1, 3))
    corrections = np.reshape([each.correction for each in result.cycles], (-1, 3))
    columns = [
        Quantity(np.arange(1, len(positions) + 1), name="cycle", head="Cycle"),
        Quantity(positions, PLACE, "value", "", head="{}", decimals=5),
        Quantity(corrections, PLACE, "deviation", "correction", head="Correction {}"),
    ]
    return Table("iterations", "Iterations", columns)
