"""What the command prints of a run."""

from __future__ import annotations

import math

from photogram.messages import listed
from photogram.perspective_center.listing import NOT_CONVERGED
from photogram.perspective_center.solution import PerspectiveCenter

__all__ = ["interior", "summary"]


def interior(result: PerspectiveCenter) -> str:
    """Return what was determined of the interior with its standard errors, mm."""
    names = {"c": "principal distance", "xp": "principal point x", "yp": "principal point y"}
    values = dict(zip(names, result.interior.tolist(), strict=True))
    errors = [math.nan] * len(result.unknown) if result.interior_errors is None else result.interior_errors
    found = [
        f"{names[name]} {values[name]:.4f} (standard error {error:.4f})"
        for name, error in zip(result.unknown, errors, strict=True)
    ]
    return f"{', '.join(found)} mm"


def summary(result: PerspectiveCenter) -> list[str]:
    """Return a set in a few lines: perspective centre, attitude, standard errors, suspects."""
    grid = result.grid
    how = "as published" if result.as_published else "least squares"
    lines = [
        f"{grid.title}, data set {grid.number}: {len(grid.ids)} points, {int(grid.readings.sum())} readings,"
        f" {how}, {len(result.cycles)} iterations"
    ]
    lines.append(f"  verdict: {result.verdict.headline}")
    lines += [f"  next: {each}" for each in result.verdict.next]
    if not result.converged:
        lines.append(f"  {NOT_CONVERGED}")
    errors = result.standard_errors
    lines.append(f"  {'':16}{'X':>12}{'Y':>12}{'Z':>12}{'omega min':>12}{'phi min':>12}{'kappa min':>12}")
    rows = [("value", [*result.position, *result.attitude_minutes], 4)]
    if errors is not None:
        rows.append(("standard error", errors.tolist(), 5))
    for name, values, decimals in rows:
        lines.append(f"  {name:<16}" + "".join(f"{value:>12.{decimals}f}" for value in values))
    if result.unknown:
        lines.append(f"  {interior(result)}")
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
