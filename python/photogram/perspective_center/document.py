"""The document of a run through a deck; tables of several sets are layers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import replace
from photogram.messages import Message
from photogram.perspective_center.solution import INTERIOR, PerspectiveCenter
from photogram.plots.picture_data import VectorField
from photogram.plots.residuals import vector_panel
from photogram.show.forms import record
from photogram.show.judgement import remarks_section, verdict_document
from photogram.show.page import Document, Drawing, Fact, Judgement, Section, about, conventions, layered
from photogram.show.quantity import Axis, Quantity, Table, column, component, members, of_each
from photogram.show.sketch.marks import Line, Mark, Markers, Panel, band, horizontal_line
from photogram.show.sketch.plot import Plot
from photogram.show.style import INK, MARKED

PLACE = tuple(map(Axis, "XYZ"))
ANGLES = tuple(Axis.of(name, "arcmin") for name in ("omega", "phi", "kappa"))
OUTWARD = (Axis("", "mm", small="um", factor=1000.0),)
ERRORS = ("X", "Y", "Z", "omega_minutes", "phi_minutes", "kappa_minutes")


def run_document(
    results: Sequence[PerspectiveCenter], messages: Sequence[Message], stop: Judgement | None
) -> Document:
    sets = [set_document(result) for result in results]
    title = sets[0].what if sets else ""
    run = layered("Perspective centre of a projector", title, sets)
    sketch = partial(run_sketch, results)
    drawing = Drawing("picture-grid", "Residuals and distortion", about("projector.caption"), sketch)
    return replace(
        run,
        judgements=[*run.judgements, *([stop] if stop else [])],
        sections=[Section("residuals", drawing.title, [drawing]), *run.sections, remarks_section(messages)],
        members={
            "units": conventions("projector"),
            "messages": [*map(str, messages)],
            "error": stop and stop.headline,
            "sets": [*map(record, sets)],
        },
    )


def set_document(result: PerspectiveCenter) -> Document:
    grid, plate, largest = result.grid, result.sigma0_plate, max(result.radial_distortion, key=abs)
    outliers = [(grid.ids[row], "XY"[axis]) for row, axis in result.outliers]
    errors = np.full(6 + len(result.unknown), np.nan)
    if result.standard_errors is not None and result.interior_errors is not None:
        errors = np.array([*result.standard_errors, *result.interior_errors])
    of_interior = () if result.covariance is None else zip(result.unknown, errors[6:], strict=True)
    return verdict_document(
        result.verdict,
        grid.title or "",
        set_name(result),
        highlights=[
            Fact.of("Standard error on the plate", plate and 1000.0 * plate, "µm", figures=3),
            Fact.of("Standard error in the model", result.sigma0_model, figures=3),
            Fact.of("Largest radial distortion", 1000.0 * largest, "µm", decimals=1),
            Fact.of("Readings beyond the limit", len(outliers), tone="look" if outliers else ""),
        ],
        sections=[*map(Section.of, (_parameters(result, errors), _points(result), _iterations(result)))],
        members={
            **members(grid, "title", data_set="number"),
            **members(result, "attitude_minutes", "sigma0_plate", "sigma0_model", "covariance", "converged"),
            "perspective_center": result.position,
            "standard_errors": dict(zip(ERRORS, errors, strict=False)),
            "interior": dict(zip(INTERIOR, result.interior, strict=True)),
            "interior_standard_errors": dict(of_interior),
            "test": {"of": "studentized", "limit": result.limit, "outliers": outliers},
            "iterations": len(result.cycles),
        },
    )


def _parameters(result: PerspectiveCenter, errors: Floats) -> Table:
    axes = (*PLACE, *ANGLES, *(Axis.of(name, "mm") for name in result.unknown))
    interior = result.interior[[INTERIOR.index(name) for name in result.unknown]]
    values, of = np.array([*result.position, *result.attitude_minutes, *interior]), np.arange(len(axes))
    columns = [
        component(axes, of)[0],
        Quantity(values, axes, "value", "value", head="Value", figures=10, of=of),
        Quantity(errors, axes, "deviation", "standard_error", head="Standard error", of=of),
    ]
    note = about(
        f"projector.{'published' if result.as_published else 'strict'}",
        points=len(result.grid.ids),
        readings=result.grid.readings.sum(),
        iterations=len(result.cycles),
    )
    title = "Perspective centre and attitude"
    return Table("parameters", title, columns, note, about("projector.parameters"), errors)


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
    note = about("projector.limit", limit=result.limit) if math.isfinite(result.limit) else ""
    return Table("points", "Points", columns, note, about("projector.points"))


def _iterations(result: PerspectiveCenter) -> Table:
    of_cycles = partial(of_each, result.cycles, axes=PLACE, member="")
    columns = [
        Quantity(np.arange(1, len(result.cycles) + 1), name="cycle", head="Cycle"),
        of_cycles("position", kind="value", name="", head="{}", decimals=5),
        of_cycles("correction", kind="deviation", name="correction", head="Correction {}"),
    ]
    return Table("iterations", "Iterations", columns)


MODEL = tuple(Axis.of(name, "model units") for name in "XY")
SAME_RADIUS = 0.02  # Points are averaged if their radii differ by less than this part of the largest


def run_sketch(results: Sequence[PerspectiveCenter]) -> Plot | None:
    """Return the plot of a run; all sets have the same scales. None without sets."""
    if not results:
        return None
    longest = max(float(np.hypot(*each.residual.T).max()) for each in results)
    largest = max(max(np.abs(each.radial_distortion).max(), each.sigma0_plate or 0.0) for each in results)
    panels = []
    for each in results:
        title = f"{set_name(each)}: measured − projected"
        vectors = VectorField(title, each.projected, each.residual, axes=MODEL)
        panels += [vector_panel(vectors, longest), _distortion_curve(each, 1000.0 * float(largest))]
    return Plot(11.0, 5.0 * len(results), panels, 2)


def set_name(result: PerspectiveCenter) -> str:
    """Return the name of a set: its number and its mean height."""
    return f"Set {result.grid.number}, Z = {result.grid.model[:, 2].mean():g}"


def _distortion_curve(result: PerspectiveCenter, largest: float) -> Panel:
    """Return distortion over radius; `largest` is the axis range (um).

    The curve omits a point at the principal point, because the sign of its distortion is undefined.
    """
    radius, distortion = result.fixed_radius, 1000.0 * result.radial_distortion
    reach, right = 1.4 * largest or 1.0, 1.05 * (float(radius.max()) or 1.0)
    marks: list[Mark] = []
    if result.sigma0_plate is not None:
        sigma = np.full(2, 1000.0 * result.sigma0_plate)
        label = f"± standard error of unit weight, {sigma[0]:.1f} µm"
        marks.append(band(np.array([0.0, right]), -sigma, sigma, "#e4e4e4", 1.0, label=label))
    places = np.column_stack([radius, distortion])
    marks += [horizontal_line(0.0, INK, 0.8), Markers(places, "o", 3.5, opacity=0.75, label="points")]
    if (radius > 0).any():
        marks.append(Line(_means(places[radius > 0]), MARKED, 1.8, label="mean of equal radii"))
    limits = np.array([[0.0, -reach], [right, reach]])
    axes = "radius on the plate, mm", "distortion, µm, positive outward"
    return Panel(limits, marks, "Radial distortion on the plate", *axes, legend="below")


def _means(places: Floats) -> Floats:
    ordered = places[np.argsort(places[:, 0], kind="stable")]
    steps = np.diff(ordered[:, 0]) > SAME_RADIUS * max(float(ordered[-1, 0]), 1e-12)
    return np.array([group.mean(axis=0) for group in np.split(ordered, np.flatnonzero(steps) + 1)])
