"""What is known of the projector of a set, quantity by quantity."""

from __future__ import annotations

import numpy as np

from photogram.perspective_center.solution import INTERIOR, PerspectiveCenter
from photogram.show.quantity import Axis, Quantity, component

__all__ = ["cycles", "points", "size_of", "unknowns"]

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
