"""Points of readers: initial positions, control and check points."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.network.observations import Control, Observation


class PointTable:
    """A table of points to which a reader adds positions, control and check points."""

    def __init__(self, names: list[str]) -> None:
        self.names = names
        self.starts, self.positions, self.check_sd = np.full((3, len(names), 3), np.nan)
        self.sd = np.full((len(names), 3), np.inf)
        self.observations: list[Observation] = []

    def control(self, row: int, xyz: Floats, covariance: Floats) -> None:
        """Add control; with correlations it becomes an observation of the point."""
        self.starts[row] = xyz
        variances = np.diag(covariance)
        if (covariance == np.diag(variances)).all():
            self.positions[row], self.sd[row] = xyz, np.where(np.isnan(xyz), np.inf, np.sqrt(variances))
        else:
            symmetric = (covariance + covariance.T) / 2
            self.observations.append(Control(self.names[row], xyz, covariance=symmetric))

    def check(self, row: int, xyz: Floats, variances: Floats) -> None:
        """Add a check point; variances that are not positive are unknown."""
        self.starts[row] = self.positions[row] = xyz
        self.check_sd[row] = np.sqrt(np.where(variances > 0, variances, np.nan))

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `assembled` for points."""
        return {
            "point_ids": self.names,
            "starts": self.starts,
            "point_positions": self.positions,
            "point_sd": self.sd,
            "point_check_sd": self.check_sd,
        }
