"""The times of the lines of a scanner, and whether they fit the tables of the same file."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.json import Tree
from photogram.io.places import at_place
from photogram.lazy_dataclasses import dataclass
from photogram.network.moving_photos import Lines

APART = 0.01
"""Of the span of a table: by how much that of the lines may differ."""


@dataclass(frozen=True)
class Drift:
    """What times lack: the rate is dt (1 + factor) + further, the first line so many lines later."""

    factor: float
    further: float
    lines: float

    def of(self, lines: Lines) -> Lines:
        """Return the corrected times of lines."""
        rows = np.array(lines.table)
        rows[:, 2] = rows[:, 2] * (1 + self.factor) + self.further
        rows[:, 1] += self.lines * rows[:, 2]
        return Lines(rows)


def read_lines(tree: Tree, center: float) -> Lines:
    """Return the times of lines from the upper edge: ISIS counts 1 in the middle of the first."""
    rates = tree["line_scan_rate"]
    rows = np.array([row.numbers(3) for row in rates])
    if not len(rows):
        raise rates.error("is empty")
    with at_place(rates):
        return Lines(rows - [0.5, -center, 0.0])


def read_drift(keywords: Tree, code: str | None) -> Drift | None:
    """Return the corrections that an instrument's keywords have; None where they have none."""
    names = [
        f"{code}_{name}" for name in ("MULTIPLI_LINE_ERROR", "ADDITIVE_LINE_ERROR", "ADDITIONAL_PREROLL")
    ]
    if code is None or names[0] not in keywords:
        return None
    return Drift(*(keywords[name].number() for name in names))


def fitting(lines: Lines, count: int, table: Floats, drift: Drift | None) -> tuple[Lines, tuple[str, ...]]:
    """Return the times of lines that fit the pointing of the same file, and what there is to say of them.

    `drift` is added where the lines then begin and end nearer to the ends of `table`, the (k,) times of the
    pointing: newer files have it in their rates already.
    """
    ends = table[[0, -1]]

    def misfit(own: Lines) -> float:
        return float(np.abs(np.sort(own.times([0.0, count])) - ends).max())

    remarks = []
    if drift is not None and misfit(drift.of(lines)) < misfit(lines):
        lines = drift.of(lines)
        remarks.append(
            "line_scan_rate lacks what the keywords MULTIPLI_LINE_ERROR, ADDITIVE_LINE_ERROR and"
            f" ADDITIONAL_PREROLL say, which was added: {np.asarray(lines.table)[0, 2]:.10g} s a line"
        )
    span, known = float(abs(np.diff(lines.times([0.0, count]))[0])), float(ends[1] - ends[0])
    if known > 0 and abs(span - known) > APART * known:
        short = "the lines are" if span < known else "the table is"
        remarks.append(
            f"the {count} lines take {span:.6g} s by line_scan_rate, the table of instrument_pointing"
            f" {known:.6g} s: {short} short by {100 * abs(span - known) / max(span, known):.1f} %"
        )
    return lines, tuple(remarks)
