"""Results as pandas data frames.

pandas rather than polars: geopandas, matplotlib and statsmodels, which people use on such tables, speak it.
It is imported only when a table is asked for. Every column that has a unit other than the linear unit of the
object space says it in its name.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from photogram.network.block import ATTITUDE_COLUMNS, position_columns

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.results.adjusted import AdjustedBlock

__all__ = [
    "check_table",
    "control_table",
    "image_table",
    "observation_table",
    "photo_table",
    "point_table",
    "station_table",
]


def photo_table(result: AdjustedBlock) -> pd.DataFrame:
    """Return adjusted photos: `photo`, position, attitude, and `sd_` of each; angles in degrees."""
    names = [*position_columns(result.block), *ATTITUDE_COLUMNS]
    values = np.hstack([result.photo_positions, result.photo_attitudes])
    return pd.DataFrame(
        {
            "photo": result.block.photo_ids,
            **_columns(names, values),
            **_columns(names, result.photo_sd, "sd_"),
        }
    )


def point_table(result: AdjustedBlock) -> pd.DataFrame:
    """Return adjusted points: `point`, `kind`, `rays`, coordinates, and `sd_` of each; angles in degrees."""
    used = result.used_points
    names = position_columns(result.block)
    return pd.DataFrame(
        {
            "point": np.array(result.block.point_ids, dtype=object)[used],
            "kind": result.point_kinds[used],
            "rays": result.point_rays[used],
            **_columns(names, result.point_positions[used]),
            **_columns(names, result.point_sd[used], "sd_"),
        }
    )


def image_table(result: AdjustedBlock) -> pd.DataFrame:
    """Return image observations: residuals in millimetres, redundancy numbers, standardized residuals."""
    block, used = result.block, result.used_images
    return pd.DataFrame(
        {
            "photo": np.array(block.photo_ids, dtype=object)[block.image_photos[used]],
            "point": np.array(block.point_ids, dtype=object)[block.image_points[used]],
            **_columns(("residual_x_mm", "residual_y_mm"), result.residuals[used]),
            **_columns(("redundancy_x", "redundancy_y"), result.redundancy[used]),
            **_columns(("standardized_x", "standardized_y"), result.standardized[used]),
        }
    )


def check_table(result: AdjustedBlock) -> pd.DataFrame:
    """Return check points: adjusted minus supplied coordinates (`d_`) and standard deviations (`sd_`)."""
    check = result.used_points & (result.point_kinds == "check")
    names = position_columns(result.block)
    return pd.DataFrame(
        {
            "point": np.array(result.block.point_ids, dtype=object)[check],
            **_columns(names, result.point_differences[check], "d_"),
            **_columns(names, result.point_sd[check], "sd_"),
        }
    )


def control_table(result: AdjustedBlock) -> pd.DataFrame:
    """Return control as observations: `residual_`, `sd_`, `redundancy_`, `standardized_` of each component.

    Residuals are observed minus adjusted. Where `sd_` is 0 a component is fixed, where it is infinite it is
    not held.
    """
    held = result.used_points & np.isfinite(result.block.point_sd).any(axis=1)
    names = position_columns(result.block)
    return pd.DataFrame(
        {
            "point": np.array(result.block.point_ids, dtype=object)[held],
            **_columns(names, result.point_residuals[held], "residual_"),
            **_columns(names, result.block.point_sd[held], "sd_"),
            **_numbers(names, result.point_redundancy[held], "redundancy_"),
            **_numbers(names, result.point_standardized[held], "standardized_"),
        }
    )


def station_table(result: AdjustedBlock) -> pd.DataFrame:
    """Return photos as observations of their own positions and attitudes, columns as in `control_table`.

    Those with a component that is weighted or fixed (`sd_` 0); free ones have an infinite `sd_`.
    """
    given_sd = result.photo_given_sd
    known = np.isfinite(given_sd).any(axis=1)
    names = [*position_columns(result.block), *ATTITUDE_COLUMNS]
    return pd.DataFrame(
        {
            "photo": np.array(result.block.photo_ids, dtype=object)[known],
            **_columns(names, result.photo_residuals[known], "residual_"),
            **_columns(names, given_sd[known], "sd_"),
            **_numbers(names, result.photo_redundancy[known], "redundancy_"),
            **_numbers(names, result.photo_standardized[known], "standardized_"),
        }
    )


def observation_table(result: AdjustedBlock) -> pd.DataFrame:
    """Return observations beside images: a row for each component, with its unit.

    Columns: `kind`, `of`, `component`, `unit`, `sd`, `residual` (observed minus adjusted), `redundancy`,
    `standardized`. Components that were not observed have no row, nor have observations that were left out.
    """
    rows = [
        (each.kind, each.names[i], each.components[k], each.units[k], *(values[i, k] for values in numbers))
        for each in result.kinds.values()
        for numbers in [(each.sd, each.residuals, each.redundancy, each.standardized)]
        for i, k in np.argwhere(~np.isnan(each.residuals)).tolist()
    ]
    names = ["kind", "of", "component", "unit", "sd", "residual", "redundancy", "standardized"]
    return pd.DataFrame(rows, columns=names)


def _numbers(names: tuple[str, ...] | list[str], values: Floats, prefix: str) -> dict[str, Any]:
    """Name the columns of an array of plain numbers."""
    return _columns([name.removesuffix("_deg") for name in names], values, prefix)


def _columns(names: tuple[str, ...] | list[str], values: Floats, prefix: str = "") -> dict[str, Any]:
    """Name the columns of an array, in degrees where the name says so."""
    with np.errstate(over="ignore"):  # infinite then
        return {
            prefix + name: np.degrees(column) if name.endswith("_deg") else column
            for name, column in zip(names, values.T, strict=True)
        }
