"""Offsets of clocks, which rows of photos and of groups name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from photogram.formats.plain.tables import Tables
from photogram.io.delimited import ColumnTable
from photogram.network.trajectories import Clock

__all__ = ["clock_columns", "clocks"]


def clocks(tables: Tables, table: ColumnTable, titles: Sequence[str]) -> list[Clock | None]:
    """Return the clock of each row, called by its title where it has no name; None where nothing is said.

    Raises
    ------
    InputError
        Offsets that are no numbers, another offset of a clock that a row before has.
    """
    values = table.numbers("time_offset", 0.0)
    sd = table.numbers("sd_time_offset", 0.0, infinite=True)
    found: list[Clock | None] = []
    for row, (name, title) in enumerate(zip(table.texts("clock"), titles, strict=True)):
        if not (name or values[row] or sd[row]):
            found.append(None)
            continue
        given = name or title, float(values[row]), float(sd[row])
        found.append(tables.shared.one(table, row, "clock", Clock, *given))
    return found


def clock_columns(clocks: Sequence[Clock | None]) -> dict[str, Any]:
    """Return the columns of clocks; none where there are none."""
    if not any(clocks):
        return {}
    return {
        "clock": ["" if each is None else each.name for each in clocks],
        "time_offset": [None if each is None else each.value for each in clocks],
        "sd_time_offset": [None if each is None else float(each.deviations[0]) for each in clocks],
    }
