"""Subjects of observations: photos, or trajectories at times; and their clocks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from photogram.formats.plain.tables import Tables, indices_of
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.observations import Attitude, Position, Range, Rate, Velocity
from photogram.network.trajectories import Clock, Readout, Trajectory
from photogram.words import phrase

_Scalar = TypeVar("_Scalar", Clock, Readout)
_COLUMNS: Mapping[type, tuple[str, str]] = {Clock: ("clock", "time_offset"), Readout: ("scan", "line_rate")}
"""Columns of the names and numbers of clocks, and of line rates of scans."""


@dataclass(frozen=True)
class Subjects:
    """The possible subjects of observations."""

    photos: Mapping[str, int]  # Photos by name, and the time of each in seconds; NaN without
    times: Sequence[float]
    trajectories: Mapping[str, Trajectory]  # By name

    def of(self, tables: Tables, table: ColumnTable) -> list[dict[str, Any] | None]:
        """Return the subject of each row as arguments; None for skipped rows.

        Rows at times outside their trajectory are skipped; a remark contains their number.
        """
        if "trajectory" not in table:
            names, rows = list(self.photos), indices_of(table, "photo", self.photos, "photo").tolist()
            return [{"photo": names[row]} for row in rows]
        times = table.numbers("time")
        spans = {name: each.reach for name, each in self.trajectories.items()}
        found: list[dict[str, Any] | None] = []
        words = table.texts("photo"), table.texts("trajectory")
        for row, (photo, name, time) in enumerate(zip(*words, times.tolist(), strict=True)):
            if bool(photo) == bool(name):
                raise table.error(row, phrase("error.exclusive", first="photo", second="trajectory"))
            for word, what, known in ((photo, "photo", self.photos), (name, "trajectory", self.trajectories)):
                if word and word not in known:
                    raise table.unknown_error(row, what, what, word, known)
            if photo:
                found.append({"photo": photo})
                continue
            if math.isnan(time):
                raise table.cell_error(row, "time", "error.empty")
            first, last = spans[name]
            inside = first <= time <= last
            own = {"photo": None, "trajectory": self.trajectories[name], "time": time}
            found.append(own if inside else None)
        if out := sum(each is None for each in found):
            tables.remark("plain.outside-trajectory", table.path, n=out)
        return found


def clocked(table: ColumnTable, row: int, of: Mapping[str, Any], clock: Clock | None) -> dict[str, Any]:
    """Return the subject of an observation, with its clock."""
    if clock is None:
        return dict(of)
    if "trajectory" not in of:
        raise table.error(row, phrase("plain.clock-of-photo"))
    return {**of, "clock": clock}


def subject_columns(
    observations: Sequence[Position | Velocity | Attitude | Rate | Range], block: Block
) -> dict[str, Any]:
    """Return the columns of the subjects of observations."""
    moments = [each.moment for each in observations]
    if not any(moments):
        # If photos have times, the times of drifts are written in addition.
        times = [each.time for each in observations] if block.timed else []
        dated = any(isinstance(each, Position) for each in observations)
        return {
            "photo": [each.photo for each in observations],
            **({"time": times} if times and dated else {}),
        }
    photos = [each.photo for each in observations]
    return {
        **({"photo": photos} if any(photos) else {}),
        "trajectory": [None if each is None else each.trajectory.name for each in moments],
        "time": [each.time for each in observations],
    }


def scalars(
    tables: Tables, table: ColumnTable, kind: type[_Scalar], titles: Sequence[str], usual: float = 0.0
) -> list[_Scalar | None]:
    """Return clock or line rate factor (default 1) of each row; None without.

    Without a name, the title is the name.
    """
    word, number = _COLUMNS[kind]
    values, sd = table.numbers(number, usual), table.numbers(f"sd_{number}", 0.0, infinite=True)
    return [
        tables.shared.one(table, row, word, kind, name or title, float(values[row]), float(sd[row]))
        if name or sd[row] or values[row] != usual
        else None
        for row, (name, title) in enumerate(zip(table.texts(word), titles, strict=True))
    ]


def scalar_columns(kind: type[Clock | Readout], own: Sequence[Clock | Readout | None]) -> dict[str, Any]:
    """Return the columns of clocks, or of factors of line rates."""
    if not any(own):
        return {}
    word, number = _COLUMNS[kind]
    return {
        word: ["" if each is None else each.name for each in own],
        number: [None if each is None else each.value for each in own],
        f"sd_{number}": [None if each is None else float(each.deviations[0]) for each in own],
    }
