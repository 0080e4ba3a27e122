"""Parts and means of large results that plots show, with notes on the omitted parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from photogram.arguments.arrays import bounds, sampled
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.show.sketch.marks import Panel
from photogram.words import phrase

T = TypeVar("T")


def thinned(what: str, rows: Indices, most: int) -> tuple[Indices, str]:
    """Return the rows to draw among many, and a remark."""
    remark = f"{most:,} of {len(rows):,} {what} are drawn, taken at random" if len(rows) > most else ""
    return sampled(rows, most), remark


def first_panels(
    plot: str, what: str, parts: Sequence[T], most: int, draw: Callable[[T], Panel]
) -> list[Panel]:
    if not parts:
        raise InputError(phrase(f"plot.{plot}"))
    panels = [draw(part) for part in parts[:most]]
    if len(parts) > most:
        note = f"the first {most} of {len(parts)} {what} are drawn"
        panels[-1] = replace(panels[-1], notes=[*panels[-1].notes, note])
    return panels


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of a frame with image points, whose means reveal common errors."""

    columns: int  # Numbers of cells across and up
    rows: int
    edges: Floats  # (2, 2) lower left and upper right corner of the frame
    own: Indices  # (m,) the cell of each image point, row by row from the lower left
    counts: Indices  # (rows columns,) image points of each cell

    @property
    def middles(self) -> Floats:
        """(rows columns, 2) middles of the cells."""
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        part = (np.column_stack([column, row]) + 0.5) / [self.columns, self.rows]
        return np.asarray(self.edges[0] + (self.edges[1] - self.edges[0]) * part)

    def means(self, values: Floats) -> Floats:
        """Return (rows columns,) means of (m,) values; NaN for empty cells."""
        known = np.isfinite(values)
        sums = np.bincount(self.own[known], values[known], minlength=len(self.counts))
        counts = np.bincount(self.own[known], minlength=len(self.counts))
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(sums / counts)


def cells(xy: Floats, longer: int) -> Cells:
    """Return nearly square cells over (m, 2) image points, `longer` on the long side."""
    low, high = bounds(xy)
    extent = np.maximum(high - low, 1e-12 + 1e-9 * np.abs(high))
    columns, rows = np.maximum(1, np.round(longer * extent / extent.max())).astype(int).tolist()
    across, up = (
        np.minimum((values - least) / width * count, count - 1).astype(np.int64)
        for values, least, width, count in zip(xy.T, low, extent, (columns, rows), strict=True)
    )
    own = up * columns + across
    return Cells(
        columns, rows, np.array([low, low + extent]), own, np.bincount(own, minlength=columns * rows)
    )
