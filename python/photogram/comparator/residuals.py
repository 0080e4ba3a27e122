"""Residuals of one case in both systems, and what is computed from them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.readings import Integers

__all__ = ["Residuals"]


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of the points of one case, in the handedness of the comparator.

    Attributes
    ----------
    points
        (n,) numbers of the points.
    xy_um
        (n, 2) comparator coordinates that the residuals belong to (X ADJ, Y ADJ), micrometres.
    comparator_um
        (n, 2) grid transformed into the comparator system less measured: what to add to the measurement.
    grid_um
        (n, 2) measurement transformed into the grid system less given grid: what to add to the given grid.
    lost
        Unknowns that a coordinate axis has lost to the adjustment: SIGMA divides by points less this.
    """

    points: Integers
    xy_um: Floats
    comparator_um: Floats
    grid_um: Floats
    lost: float

    @property
    def squares_um2(self) -> tuple[float, float, float, float]:
        """Sums of squares: comparator x, y, grid X, Y (SUM VV)."""
        x, y = (self.comparator_um**2).sum(axis=0)
        grid_x, grid_y = (self.grid_um**2).sum(axis=0)
        return float(x), float(y), float(grid_x), float(grid_y)

    @property
    def sigma_um(self) -> tuple[float, ...]:
        """Root of each sum of squares over points less `lost` (SIGMA); NaN without redundancy."""
        return tuple(self._sigma(square, 1) for square in self.squares_um2)

    @property
    def sigma0_um(self) -> float:
        """Standard error of unit weight, comparator x and y (equations 52, 60); NaN without redundancy."""
        return self._sigma(sum(self.squares_um2[:2]), 2)

    def _sigma(self, square: float, axes: int) -> float:
        dof = axes * (len(self.points) - self.lost)
        return math.sqrt(square / dof) if dof > 1e-9 else math.nan
