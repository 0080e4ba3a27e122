"""The result of an absolute orientation: an oriented model and the ways to show it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.absolute_orientation.document import to_json
from photogram.absolute_orientation.oriented import OrientedModel
from photogram.absolute_orientation.plot import figure
from photogram.absolute_orientation.report import report
from photogram.show.pictures import drawn

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Orientation"]


class Orientation(OrientedModel):
    """An oriented model with its table, report, JSON document and picture."""

    def control_table(self) -> pd.DataFrame:
        """Return stations as a data frame: residuals in both units, redundancy numbers, test values."""
        import pandas as pd  # takes long to import

        axes = ("X", "Y", "Z")
        parts = {
            "residual_": self.residuals,
            "residual_ground_": self.residuals_ground,
            "redundancy_": self.redundancy,
            "standardized_": self.standardized,
            "studentized_": self.studentized,
        }
        columns = {
            prefix + axis: values[self.took_part, k]
            for prefix, values in parts.items()
            for k, axis in enumerate(axes)
        }
        return pd.DataFrame({"id": np.array(self.stations.ids, dtype=object)[self.took_part], **columns})

    def report(self) -> str:
        """Return the listing as text."""
        return report(self)

    def to_json(self) -> bytes:
        """Return the whole result as JSON (UTF-8); `docs/absolute-orientation.md` lists its members."""
        return to_json(self)

    def plot(self) -> bytes:
        """Return a plan of the residuals of the control as a picture (PNG)."""
        return drawn(figure(self))
