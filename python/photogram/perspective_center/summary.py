"""What the command prints of a run."""

from __future__ import annotations

import math

from photogram.messages import listed
from photogram.perspective_center.listing import NOT_CONVERGED
from photogram.perspective_center.solution import PerspectiveCenter
from photogram.perspective_center.tables import size_of, unknowns
from photogram.show.lines import field, table_lines

__all__ = ["summary"]


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
