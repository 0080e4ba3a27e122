"""The document of an orientation; see `docs/absolute-orientation.md`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.absolute_orientation.stations import Stations
from photogram.arguments.types import Floats
from photogram.io import json
from photogram.results.network_tables import iteration_table
from photogram.show.forms import record
from photogram.show.judgement import remarks_section, verdict_document, verdict_table
from photogram.show.page import Document, Drawing, Fact, Facts, Section, about, conventions, significant
from photogram.show.quantity import Axis, Quantity, Table, chosen, column, members
from photogram.show.sketch.marks import Arrows, Line, Mark, Markers, Names, Panel, around
from photogram.show.sketch.plot import Plot
from photogram.show.style import INK, PURPLE, VERMILION, round_length
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import Orientation

STARTS = {
    "restart": "a former result",
    "report": "the first two stations",
    "closed-form": "the closed form",
}


def orientation_document(result: Orientation) -> Document:
    stations, (size, quality) = result.stations, _facts(result)
    caption = "The control in plan with its residuals, given minus transformed, enlarged as the scale says."
    drawing = Drawing("picture-residuals", "Residuals of the control in plan", caption, result.plot)
    of_parameters, unit = parameters(result), f"{stations.model_unit} / {stations.ground_unit}"
    return verdict_document(
        result.verdict,
        "Absolute orientation of a model",
        "",
        highlights=[
            *quality[:2],
            Fact.of("Scale", result.similarity.scale, unit, figures=6),
            *size[3:],
            size[0],
        ],
        sections=[
            Section("residuals", "Residuals in plan", [drawing]),
            Section.of(of_parameters),
            Section.of(control(result)),
            Section.of(rejected(result)),
            Section("size", "Size and fit", [Facts("Size", size), Facts("Fit", quality)]),
            Section.of(verdict_table(result.verdict)),
            Section.of(points(result)),
            Section.of(cycles(result)),
            remarks_section(result.problems),
        ],
        details=[Section.of(rotation(result)), Section.of(model_residuals(result))],
        members=_members(result),
    )


def _facts(result: Orientation) -> tuple[list[Fact], list[Fact]]:
    given, scale = result.used.sum(axis=0).tolist(), result.similarity.scale
    model, ground = result.stations.model_unit, result.stations.ground_unit
    done = len(result.iterations) if result.cycles is None else len(result.cycles)
    known = ", ".join(f"{count} {axis}" for count, axis in zip(given, "XYZ", strict=True))
    much = [
        Fact("Status", f"{result.status} after {done} iterations", note=f"method {result.method}"),
        Fact("Initial values", STARTS[result.started]),
        Fact("Stations that took part", f"{int(result.took_part.sum())} of {len(result.stations.ids)}"),
        Fact.of("Known coordinates", result.known, note=known),
        Fact.of("Degrees of freedom", result.degrees_of_freedom),
    ]
    in_model = f"{significant(result.rms, 6)} {model} in the model"
    sigma0, unit, note = "undefined", "", ""
    if result.sigma0 is not None:
        sigma0 = significant(result.sigma0, 6)
        if not result.weighted:
            unit, note = model, f"{significant(result.sigma0 / scale, 6)} {ground} on the ground"
    condition = "of the equations: rotations, relative scale, shifts"
    good = [
        Fact.of("rms of residuals on the ground", result.rms / scale, ground, in_model, figures=6),
        Fact("Standard deviation of unit weight", sigma0, unit, note),
        Fact.of("Condition number", result.condition, note=condition, decimals=1),
    ]
    return much, good


def _members(result: Orientation) -> dict[str, object]:
    test, similarity = result.test, result.similarity
    units = {"ground": result.stations.ground_unit, "model": result.stations.model_unit}
    return {
        "program": f"photogram {_photocore.__version__} absolute-orientation",
        "units": conventions("orientation-units", **units, sigma0="1" if result.weighted else units["model"]),
        "conventions": conventions("orientation"),
        **members(
            result,
            *("method", "status", "usable", "scale_held", "covariance_scale", "rms", "sigma0", "condition"),
            *("degrees_of_freedom", "weighted_sum_of_squares"),
            start="started",
            messages="problems",
            known_coordinates="known",
        ),
        **members(similarity, "scale", "rotation", "translation", "covariance", "deviation_factor"),
        "angles_rad": similarity.angles,
        "iterations": len(result.iterations) if result.cycles is None else len(result.cycles),
        "initial": members(result.initial, "scale", "translation", angles_rad="angles"),
        "global_test": test
        and members(
            test,
            *("limits", "probability", "rejected_high", "rejected_low"),
            variance_of_unit_weight="variance",
        ),
        "test": {
            "of": "standardized" if result.decided_by_w else "studentized",
            "limit": result.limit if math.isfinite(result.limit) else None,
            "outliers": [[result.stations.ids[row], "XYZ"[axis]] for row, axis in result.outliers],
        },
        "centres": members(similarity, control="control_centre", model="model_centre"),
    }


def to_json(result: Orientation) -> bytes:
    """Return the result as JSON (UTF-8); points are stations without control."""
    return without_points(result) + point_rows(*result.transform_points()) + json.CLOSED


def without_points(result: Orientation) -> bytes:
    """Return the document up to its first point, for any number of points."""
    return json.opened(record(result.document()), "points")


def point_rows(ids: Iterable[str], positions: Floats, covariances: Floats) -> bytes:
    rows = zip(ids, positions.tolist(), covariances.tolist(), strict=True)
    return json.elements({"id": name, "position": place, "covariance": own} for name, place, own in rows)


def orientation_findings(result: Orientation) -> Findings:
    """Return the tests of an orientation: w with a priori sd, otherwise t."""

    def name(index: tuple[int, ...]) -> Phrase:
        station, axis = result.stations.ids[index[0]], "XYZ"[index[1]]
        return Phrase("named.coordinate", {"axis": axis, "station": station})

    control = Tested("control", result.tested, name, "w")
    if not result.decided_by_w:
        control = Tested("control", result.tested, name, "t", second=max(result.degrees_of_freedom - 1, 1))
    if_usable = []
    if not result.weighted and result.degrees_of_freedom:
        if_usable.append(Phrase("advice.give-sd"))
    if result.degrees_of_freedom == 0:
        if_usable.append(Phrase("advice.spare-coordinate"))
    if_usable += [
        Phrase("advice.alternative", {"scale": significant(each.scale, 6)})
        for each in result.alternatives[:1]
    ]
    return Findings(
        status=result.status,
        observations=[control],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.test,
        untested=Phrase("untested.sd" if not result.weighted else "untested.freedom"),
        scaled=result.unit_variance != "unity",
        hints=[message.phrase or str(message) for message in result.grave],
        take_out=Phrase("advice.leave-station-out"),
        if_usable=if_usable,
    )


LISTED = 300  # Maximum number of transformed points in printed tables


def control(result: Orientation) -> Table:
    """Return used control: residuals, redundancy, tests, adjusted coordinates."""
    numbers, ground, model = (
        _axes("XYZ", unit) for unit in ("", result.stations.ground_unit, result.stations.model_unit)
    )
    seen, marked = result.redundancy >= TESTABLE, np.abs(result.tested) > result.limit
    of_w, of_t = (marked, None) if result.decided_by_w else (None, marked)
    columns = [
        _names(result),
        Quantity(*(result.residuals, model, "deviation", "residual", "residual"), head="Residual", figures=4),
        Quantity(
            *(result.residuals_ground, ground, "deviation", "residual_ground", "residual_ground"),
            head="Residual",
            figures=4,
        ),
        Quantity(result.model_residuals, _axes("xyz", model[0].unit), "deviation", member="residual_model"),
        column("redundancy", result.redundancy, "Redundancy", axes=numbers, decimals=3),
        column("standardized", result.standardized, "w", axes=numbers, decimals=2, seen=seen, marked=of_w),
        column("studentized", result.studentized, "t", axes=numbers, decimals=2, seen=seen, marked=of_t),
        Quantity(result.adjusted_control, ground, "value", member="adjusted"),
        Quantity(result.control_covariances, member="covariance"),
    ]
    about = "Given minus transformed: u = s X - A^T (x - B) in units of the model, and u / s on the ground."
    rows = np.flatnonzero(result.took_part)
    shown = np.argwhere(result.used[rows])
    return Table("control", "Control", chosen(columns, rows), _test(result), about, shown=shown)


def _test(result: Orientation) -> str:
    law = "none" if not math.isfinite(result.limit) else "normal" if result.decided_by_w else "student"
    tests, freedom = int(np.isfinite(result.tested).sum()), result.degrees_of_freedom - 1
    return about(f"orientation.{law}", freedom=freedom, limit=result.limit, tests=tests)


def model_residuals(result: Orientation) -> Table:
    """Return the residuals of the used control in the axes of the model."""
    residuals = Quantity(
        result.model_residuals, _axes("xyz", result.stations.model_unit), "deviation", head="v{}", figures=4
    )
    columns = chosen([_names(result, member=""), residuals], np.flatnonzero(result.took_part))
    about = "v = s A X + B - x with the adjusted control X."
    return Table("model_residuals", "Residuals in the model", columns, "", about)


def rejected(result: Orientation) -> Table:
    there = result.stations.given & ~result.used
    rows = np.flatnonzero(there.any(axis=1))
    differences = np.where(there, result.differences, np.nan)
    columns = [
        _names(result),
        Quantity(
            *(differences, _axes("XYZ", result.stations.ground_unit), "deviation", "d", "residual_ground"),
            head="Given - transformed",
            figures=4,
        ),
    ]
    shown = np.argwhere(there[rows])
    return Table("rejected", "Control that took no part", chosen(columns, rows), shown=shown)


def parameters(result: Orientation) -> Table:
    """Return the seven parameters with their standard deviations, one per row."""
    similarity, stations = result.similarity, result.stations
    axes = (
        *(Axis.turned(name, "deg") for name in ("omega", "phi", "kappa")),
        Axis.of("s", f"{stations.model_unit} / {stations.ground_unit}"),
        *(Axis.of(name, stations.model_unit) for name in ("b1", "b2", "b3")),
    )
    of, covariance = np.arange(7), similarity.covariance
    sd = np.full(7, np.nan) if covariance is None else np.sqrt(np.diag(covariance))
    values = np.array([*similarity.angles, similarity.scale, *similarity.translation])
    units = ["deg, sd arcsec" if axis.angle else axis.unit for axis in axes]
    columns = [
        Quantity([axis.name for axis in axes], kind="name", head="Parameter"),
        Quantity(values, axes, "value", head="Value", figures=10, of=of),
        Quantity(sd, axes, "deviation", head="sd", words={0.0: "held"} if result.scale_held else None, of=of),
        Quantity(units, kind="name", head="Unit"),
    ]
    about = "x = s A X + B, from the ground to the model."
    return Table("parameters", "Parameters", columns, "", about, sd)


def rotation(result: Orientation) -> Table:
    matrix = Quantity(result.similarity.rotation, _axes("XYZ"), head="{}", decimals=12)
    return Table("rotation_matrix", "Rotation matrix A", [matrix])


def points(result: Orientation) -> Table:
    ids, positions, covariances = result.transform_points()
    sd = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    axes = _axes("XYZ", result.stations.ground_unit)
    columns = [
        Quantity(np.array(ids, dtype=object), kind="name", name="id", head="Point"),
        Quantity(positions, axes, "value", "", head="{}"),
        Quantity(sd, axes, "deviation", "sd", head="sd {}"),
    ]
    more = len(ids) > LISTED
    note = f"The first {LISTED} of {len(ids)}; the JSON document contains all." if more else ""
    shown = np.arange(LISTED) if more else None
    return Table("points", "Transformed points", columns, note, deviations=sd, shown=shown)


def cycles(result: Orientation) -> Table:
    if result.cycles is None:
        columns = iteration_table(result.iterations)
    else:
        axis, corrections = (Axis.of("", "rad"),), np.array(result.cycles)
        head = "Largest correction of an angle"
        columns = [
            Quantity(np.arange(1, len(corrections) + 1), member="number", head="Cycle"),
            Quantity(corrections, axis, "deviation", member="largest_correction_rad", head=head),
        ]
    return Table("cycles", "Iterations", columns)


def _names(result: Orientation, member: str = "id") -> Quantity:
    return Quantity(np.array(result.stations.ids, dtype=object), (), "name", "id", member, head="Station")


def _axes(names: str, unit: str = "") -> tuple[Axis, ...]:
    return tuple(Axis.of(name, unit) for name in names)


LONGEST_RESIDUAL = 0.12  # As a part of the larger side of the plan


def control_plot(
    stations: Stations,
    rows: NDArray[np.intp],
    plan: Floats,
    residuals: Floats,
    used: NDArray[np.bool_],
    rms: float,
) -> Plot:
    """Plot control residuals: arrows in plan, bars for elevations."""
    unit = stations.ground_unit
    size = float(np.ptp(plan, axis=0).max())
    largest = float(np.nanmax(np.abs(residuals)))
    factor = LONGEST_RESIDUAL * size / largest if largest > 0 else 0.0
    high = float(np.clip(5.5 * np.ptp(plan[:, 1]) / (np.ptp(plan[:, 0]) or 1.0), 2.0, 8.0))
    vectors, ends = _residuals(plan, residuals * factor)
    names = [stations.ids[row] for row in rows.tolist()]
    length = round_length(LONGEST_RESIDUAL * size / factor) if factor else 0.0
    panel = Panel(
        around(np.vstack([plan, ends]), 0.1),
        [*_stations(used, plan), *vectors, Names(plan, names, [INK] * len(names), ends)],
        f"Residuals of control, rms {rms:.3g} {unit}",
        f"X, {unit}",
        f"Y, {unit}",
        equal=True,
        bars=[(length * factor, INK, f"{length:g} {unit}, given minus transformed")] if factor else [],
        legend="below",
    )
    return Plot(6.5, high + 1.8, [panel])


def _stations(used: NDArray[np.bool_], plan: Floats) -> list[Mark]:
    full, plan_only = used.all(axis=1), ~used[:, 2]
    kinds = (
        ("full control", full, "^"),
        ("horizontal control", plan_only, "s"),
        ("height control", ~(full | plan_only), "o"),
    )
    return [
        Markers(plan[chosen], shape, 6.0, face="none", label=name)
        for name, chosen, shape in kinds
        if chosen.any()
    ]


def _residuals(plan: Floats, enlarged: Floats) -> tuple[list[Mark], Floats]:
    """Return marks of scaled residuals, and points along them to be avoided by names."""
    flat, high = np.isfinite(enlarged[:, :2]).any(axis=1), np.isfinite(enlarged[:, 2])
    steps = np.nan_to_num(enlarged)
    up = np.column_stack([np.zeros(len(plan)), steps[:, 2]])
    marks: list[Mark] = []
    if flat.any():
        marks.append(Arrows(plan[flat], steps[flat, :2], VERMILION, 0.004, label="plan residual", layer=3.0))
    bars = np.stack([plan[high], plan[high] + up[high]], axis=1)
    marks.append(Line(bars, PURPLE, 3.0, label="height residual (up: positive)"))
    parts = np.linspace(0.25, 1.0, 4)[:, np.newaxis, np.newaxis]
    return marks, np.concatenate([plan + parts * steps[:, :2], plan + parts * up]).reshape(-1, 2)
