"""Tables as CSV with exact numbers, and names in quotes if needed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram import _photocore

_ARRAYS = {"f": np.float64, "i": np.int64, "u": np.int64, "b": np.bool_}  # By types of arrays


def csv_text(columns: Mapping[str, Sequence[Any] | Any], comments: Sequence[str] = ()) -> bytes:
    """Return a table as CSV with comments; empty cells for NaN and None."""
    head = [*(f"# {each}" for each in comments), ",".join(columns)]
    return _photocore.csv_rows(
        ("\n".join(head) + "\n").encode(), [_column(column) for column in columns.values()]
    )


def _column(column: Any) -> Any:
    if isinstance(column, np.ndarray):
        if kind := _ARRAYS.get(column.dtype.kind):
            return np.ascontiguousarray(column, dtype=kind)
        column = column.tolist()
    if {*map(type, column)} == {str}:
        return column
    return [each if isinstance(each, str) else _cell(each) for each in column]


def _cell(value: Any) -> str | None:
    if value is None:
        return None
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, float):
        return None if math.isnan(value) else repr(float(value))
    return str(value)
