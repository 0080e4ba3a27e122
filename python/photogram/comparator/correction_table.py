"""Values of the polynomials over the range of the comparator (subroutine PLOT)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from photogram.adjusted import Floats
    from photogram.comparator.polynomial import Polynomial

__all__ = ["table_nodes", "table_values"]

ROWS = 9


def table_nodes(centre_um: tuple[float, float], half_range_um: float = 100_000.0) -> list[Floats]:
    """Return the nodes of the program's table: nine rows of falling x, with nine or five falling y.

    Parameters
    ----------
    centre_um
        Middle of the table; the program took 125 mm for both.
    half_range_um
        Half of its extent; the program took 100 mm.

    Returns
    -------
    A list of rows, each (9, 2) or (5, 2), in micrometres.
    """
    steps = np.linspace(1.0, -1.0, ROWS) * half_range_um
    rows = []
    for row, x in enumerate(steps.tolist()):
        y = steps if row % 2 == 0 else steps[::2]
        rows.append(np.column_stack([np.full(len(y), centre_um[0] + x), centre_um[1] + y]))
    return rows


def table_values(polynomial: Polynomial, nodes: list[Floats]) -> list[Floats]:
    """Return the corrections at the nodes, row by row, in micrometres."""
    return [polynomial.evaluate(row) for row in nodes]
