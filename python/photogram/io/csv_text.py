"""Tables as text of commas: numbers read back to the last bit, names stand in quotation marks at need."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

__all__ = ["csv_text"]

_QUOTED = frozenset(',;"|\t#')


def csv_text(columns: Mapping[str, Sequence[Any] | Any], comments: Sequence[str] = ()) -> bytes:
    """Return a table as text: a header and a line a row; empty cells for NaN and None.

    Parameters
    ----------
    columns
        Columns of one length by their names: arrays, or lists of numbers, texts and truth values.
    comments
        Lines before the header, marked as comments.
    """
    cells = [_cells(column) for column in columns.values()]
    lines = [*(f"# {each}" for each in comments), ",".join(columns)]
    lines += map(",".join, zip(*cells, strict=True))
    return ("\n".join(lines) + "\n").encode()


def _cells(column: Any) -> list[str]:
    if isinstance(column, np.ndarray) and column.dtype.kind == "f":
        if np.isfinite(column).all():
            return list(map(repr, column.tolist()))
        return [_cell(each) for each in column.tolist()]
    return [_cell(each) for each in (column.tolist() if isinstance(column, np.ndarray) else column)]


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(float(value))
    text = str(value)
    if _QUOTED.isdisjoint(text) and "\n" not in text and text == text.strip():
        return text
    return '"' + text.replace("\n", " ").replace('"', '""') + '"'
