"""The tables of an orientation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.results.network_tables import iteration_table
from photogram.show.page import about
from photogram.show.quantity import Axis, Quantity, Table, chosen, column
from photogram.statistics.reliability import TESTABLE

if TYPE_CHECKING:
    from photogram import Orientation

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
    """Return unused control: given minus transformed."""
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
    """Return the rotation matrix A."""
    matrix = Quantity(result.similarity.rotation, _axes("XYZ"), head="{}", decimals=12)
    return Table("rotation_matrix", "Rotation matrix A", [matrix])


def points(result: Orientation) -> Table:
    """Return the stations without control, transformed."""
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
    """Return the iterations, or the cycles of the report's methods."""
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
