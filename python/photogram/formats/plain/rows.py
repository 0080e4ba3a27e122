"""Rows of tables: cells that must not be empty, and what is made of a row."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.delimited import ColumnTable

__all__ = ["check_given", "made"]

_Made = TypeVar("_Made")


def check_given(table: ColumnTable, values: Floats, columns: Sequence[str], why: str = "is empty") -> None:
    """Refuse NaN among the values of some columns, with row and column."""
    missing = np.argwhere(np.isnan(values))
    if len(missing):
        row, column = missing[0].tolist()
        raise table.error(row, f"column {columns[column]}: {why}")


def made(table: ColumnTable, row: int, make: Callable[[], _Made]) -> _Made:
    """Make something of a row; what it refuses is an error of the row."""
    try:
        return make()
    except InputError as error:
        raise (error if error.file else table.error(row, error.message)) from None
