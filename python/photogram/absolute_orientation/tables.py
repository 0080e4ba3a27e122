"""The table of the control of an orientation: named columns."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.absolute_orientation.orientation import Orientation
from photogram.show.quantity import Axis, Quantity, chosen, frame
from photogram.show.ways import columns_of

__all__ = ["control"]


@columns_of.register(Orientation)
def control(result: Orientation, what: str) -> dict[str, Any]:
    """Return the columns of the stations that took part; there is no other table."""
    parts = {
        "residual": result.residuals,
        "residual_ground": result.residuals_ground,
        "redundancy": result.redundancy,
        "standardized": result.standardized,
        "studentized": result.studentized,
    }
    ids, axes = np.array(result.stations.ids, dtype=object), tuple(map(Axis, "XYZ"))
    table = [Quantity(ids, name="id"), *(Quantity(values, axes, name=name) for name, values in parts.items())]
    return frame(chosen(table, np.flatnonzero(result.took_part)))
