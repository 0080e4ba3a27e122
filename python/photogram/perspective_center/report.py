"""What is known of the projector of a set: tables, verdict, JSON, what the command prints of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.io import json
from photogram.messages import listed
from photogram.perspective_center.batch import Run
from photogram.perspective_center.listing import NOT_CONVERGED
from photogram.perspective_center.solution import INTERIOR, PerspectiveCenter
from photogram.show.lines import field, table_lines
from photogram.show.methods import findings_of
from photogram.show.quantity import Axis, Quantity, component, records
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE

_PLACE = tuple(map(Axis, "XYZ"))
_PLAN = _PLACE[:2]


def size_of(result: PerspectiveCenter) -> str:
    """Return how much was measured, and how it was adjusted."""
    grid, how = result.grid, "as published" if result.as_published else "least squares"
    readings = int(grid.readings.sum())
    return f"{len(grid.ids)} points, {readings} readings, {how}, {len(result.cycles)} iterations"


def unknowns(result: PerspectiveCenter) -> list[Quantity]:
    """Return what was determined with its standard errors, each in a row: components, values, errors."""
    turns = [Axis.of(name, "arcmin") for name in ("omega", "phi", "kappa")]
    axes = (*_PLACE, *turns, *(Axis.of(name, "mm") for name in result.unknown))
    of, interior = np.arange(len(axes)), dict(zip(INTERIOR, result.interior, strict=True))
    values = [*result.position, *result.attitude_minutes, *(interior[name] for name in result.unknown)]
    errors = np.full(len(axes), np.nan)
    if result.standard_errors is not None and result.interior_errors is not None:
        errors = np.array([*result.standard_errors, *result.interior_errors])
    return [
        component(axes, of)[0],
        Quantity(np.array(values), axes, "value", head="Value", figures=10, of=of),
        Quantity(errors, axes, "deviation", head="Standard error", of=of),
    ]


def points(result: PerspectiveCenter) -> list[Quantity]:
    """Return the points of the grid: readings, means, residuals, distortion, tests."""
    grid, beyond = result.grid, np.abs(result.studentized) > result.limit
    outward = Axis("", "mm", small="um", factor=1000.0)
    return [
        Quantity(np.array(grid.ids, dtype=object), kind="name", member="id", head="Point"),
        Quantity(grid.readings, member="readings", head="Readings"),
        Quantity(grid.model[:, :2], _PLAN, "value", member="mean"),
        Quantity(result.residual, _PLAN, "deviation", member="residual", head="Residual {}", decimals=4),
        Quantity(
            result.radial_distortion,
            (outward,),
            "deviation",
            member="radial_distortion",
            head="Radial distortion",
            decimals=1,
        ),
        Quantity(result.redundancy, _PLAN, member="redundancy", head="Redundancy {}", decimals=3),
        Quantity(result.standardized, _PLAN, member="standardized"),
        Quantity(result.studentized, _PLAN, member="studentized", head="t {}", decimals=2, marked=beyond),
    ]


def cycles(result: PerspectiveCenter) -> list[Quantity]:
    """Return the iteration: positions after each cycle, and their corrections."""
    positions, corrections = (
        np.array([getattr(each, name)[:3] for each in result.cycles]).reshape(-1, 3)
        for name in ("position", "correction")
    )
    return [
        Quantity(np.arange(1, len(positions) + 1), head="Cycle"),
        Quantity(positions, _PLACE, "value", head="{}", decimals=5),
        Quantity(corrections, _PLACE, "deviation", head="Correction {}"),
    ]


@findings_of.register(PerspectiveCenter)
def projector_findings(result: PerspectiveCenter) -> Findings:
    """Return the tests of a projector: no standard deviation is given, residuals are tested by t."""

    def name(index: tuple[int, ...]) -> str:
        return f"{'XY'[index[1]]} of point {result.grid.ids[index[0]]}"

    values = np.where(result.redundancy >= TESTABLE, result.studentized, np.nan)
    freedom = result.degrees_of_freedom
    return Findings(
        status="converged" if result.converged else "not converged",
        observations=[Tested("readings of the grid", values, name, "t", second=max(freedom - 1, 1))],
        degrees_of_freedom=freedom,
        untested="no standard deviations are given",
    )


def to_json(run: Run) -> bytes:
    """Return a run as JSON (UTF-8). What is not a number is null."""
    document = {
        "program": f"photogram {_photocore.__version__}",
        "units": {
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
        },
        "messages": [str(message) for message in run.messages],
        "error": None if run.stop is None else str(run.stop.error),
        "sets": [_set(result) for result in run.results],
    }
    return json.to_json(document)


def _set(result: PerspectiveCenter) -> dict[str, Any]:
    names = ("X", "Y", "Z", "omega_minutes", "phi_minutes", "kappa_minutes")
    errors = [None] * 6 if result.standard_errors is None else result.standard_errors.tolist()
    return {
        "title": result.grid.title,
        "data_set": result.grid.number,
        "perspective_center": result.position.tolist(),
        "attitude_minutes": result.attitude_minutes.tolist(),
        "standard_errors": dict(zip(names, errors, strict=True)),
        "interior": dict(zip(INTERIOR, result.interior.tolist(), strict=True)),
        "interior_standard_errors": {}
        if result.interior_errors is None
        else dict(zip(result.unknown, result.interior_errors.tolist(), strict=True)),
        "sigma0_plate": result.sigma0_plate,
        "sigma0_model": result.sigma0_model,
        "covariance": None if result.covariance is None else result.covariance.tolist(),
        "test": {
            "of": "studentized",
            "limit": result.limit if math.isfinite(result.limit) else None,
            "outliers": [[result.grid.ids[row], "XY"[axis]] for row, axis in result.outliers],
        },
        "verdict": result.verdict.document(),
        "converged": result.converged,
        "iterations": len(result.cycles),
        "points": records(points(result)),
    }


def summary(result: PerspectiveCenter) -> list[str]:
    """Return a set in a few lines: perspective centre, attitude, standard errors, suspects."""
    grid = result.grid
    lines = [f"{grid.title}, data set {grid.number}: {size_of(result)}"]
    lines.append(f"  verdict: {result.verdict.headline}")
    lines += [f"  next: {each}" for each in result.verdict.next]
    if not result.converged:
        lines.append(f"  {NOT_CONVERGED}")
    names, values, errors = unknowns(result)
    row = [*field(names, 14, head="unknown", gap="  "), *field(values, 12, ".4f", "value")]
    lines += table_lines([*row, *field(errors, 16, ".5f", "standard error")])
    if result.sigma0_plate is None or result.sigma0_model is None:
        return [*lines, "  no redundancy: no standard errors"]
    lines.append(
        f"  standard error of unit weight {result.sigma0_plate:.5f} mm on the plate,"
        f" {result.sigma0_model:.5f} in the model; largest radial distortion"
        f" {1000 * max(result.radial_distortion, key=abs):+.1f} um"
    )
    if not math.isfinite(result.limit):
        return [*lines, "  no test of single residuals: it takes two degrees of freedom"]
    suspects = [
        f"{grid.ids[row]} {'XY'[axis]} ({result.studentized[row, axis]:+.2f})"
        for row, axis in result.outliers
    ]
    return [*lines, f"  studentized residuals beyond {result.limit:.2f}: {listed(suspects) or 'none'}"]
