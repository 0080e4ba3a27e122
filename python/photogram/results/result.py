"""The result of an adjustment: an adjusted block and the ways to show it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.results.adjusted import AdjustedBlock
from photogram.results.document import to_json
from photogram.results.report import report

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Result"]


class Result(AdjustedBlock):
    """An adjusted block with its tables, report and JSON document."""

    def photo_table(self) -> pd.DataFrame:
        """Return adjusted photos as a data frame: values and standard deviations, angles in degrees."""
        from photogram.results import tables  # pandas takes long to import

        return tables.photo_table(self)

    def point_table(self) -> pd.DataFrame:
        """Return adjusted points as a data frame: kind, rays, values and standard deviations, in degrees."""
        from photogram.results import tables  # pandas takes long to import

        return tables.point_table(self)

    def image_table(self) -> pd.DataFrame:
        """Return image observations as a data frame: residuals, redundancy numbers, test values."""
        from photogram.results import tables  # pandas takes long to import

        return tables.image_table(self)

    def check_table(self) -> pd.DataFrame:
        """Return check points as a data frame: adjusted minus supplied coordinates, standard deviations."""
        from photogram.results import tables  # pandas takes long to import

        return tables.check_table(self)

    def control_table(self) -> pd.DataFrame:
        """Return control as a data frame: residuals of held components, redundancy numbers, test values."""
        from photogram.results import tables  # pandas takes long to import

        return tables.control_table(self)

    def station_table(self) -> pd.DataFrame:
        """Return weighted and fixed stations as a data frame: residuals, redundancy numbers, test values."""
        from photogram.results import tables  # pandas takes long to import

        return tables.station_table(self)

    def observation_table(self) -> pd.DataFrame:
        """Return observations beside images as a data frame, a row for each component."""
        from photogram.results import tables  # pandas takes long to import

        return tables.observation_table(self)

    def report(self) -> str:
        """Return the adjustment report as text."""
        return report(self)

    def to_json(self) -> bytes:
        """Return the whole result as a JSON document (UTF-8); `docs/json.md` lists its members."""
        return to_json(self)
