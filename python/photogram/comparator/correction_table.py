"""Values of the polynomials at fixed places of the comparator (subroutine PLOT).

The places depend on the comparator only, so that its calibrations can be compared over the years.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.polynomial import Polynomial

__all__ = ["STEP_UM", "inside", "table_nodes", "table_values"]

STEP_UM = 25_000.0
"""Distance of the nodes."""
ROWS = 9


def table_nodes(centre_um: float) -> list[Floats]:
    """Return the nodes of the program's table: nine rows of falling x, with nine or five falling y.

    Parameters
    ----------
    centre_um
        Middle of the range of the comparator in x and in y (TRANS); the nodes reach 0.1 m to either side.

    Returns
    -------
    A list of rows, each (9, 2) or (5, 2), in micrometres.
    """
    steps = STEP_UM * np.arange(ROWS // 2, -(ROWS // 2) - 1, -1)
    rows = []
    for row, x in enumerate(steps.tolist()):
        y = steps if row % 2 == 0 else steps[::2]
        rows.append(centre_um + np.column_stack([np.full(len(y), x), y]))
    return rows


def table_values(polynomial: Polynomial, nodes: list[Floats]) -> list[Floats]:
    """Return the corrections at the nodes, row by row, in micrometres."""
    return [polynomial.evaluate(row) for row in nodes]


def inside(polynomial: Polynomial, places_um: Floats) -> list[bool]:
    """Say of places (n, 2) whether both coordinates were measured; beyond, the polynomials extrapolate."""
    furthest = np.abs(polynomial.frame.arguments(places_um)).max(axis=1)
    return [distance <= 1 + 1e-9 for distance in furthest.tolist()]
