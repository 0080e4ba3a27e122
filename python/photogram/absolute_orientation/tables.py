"""The table of the control of an orientation: named columns."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.absolute_orientation.orientation import Orientation
from photogram.results.tables import named
from photogram.show.ways import columns_of

__all__ = ["control"]


@columns_of.register(Orientation)
def control(result: Orientation, what: str) -> dict[str, Any]:
    """Return the columns of the stations that took part; there is no other table."""
    parts = {
        "residual_": result.residuals,
        "residual_ground_": result.residuals_ground,
        "redundancy_": result.redundancy,
        "standardized_": result.standardized,
        "studentized_": result.studentized,
    }
    columns: dict[str, Any] = {"id": np.array(result.stations.ids, dtype=object)[result.took_part]}
    for prefix, values in parts.items():
        columns |= named("XYZ", values[result.took_part], prefix)
    return columns
