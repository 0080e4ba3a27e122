"""A picture before it is drawn: panels side by side and below each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.show.sketch.marks import Mark, Shades

ScaleBar: TypeAlias = tuple[float, str, str]
"""Length in the unit of the axis across, colour, and what it stands for."""


@dataclass(frozen=True, eq=False)
class Panel:
    """One pair of axes with what is on it."""

    limits: Floats  # (2, 2) values at the lower left and at the upper right corner
    marks: Sequence[Mark] = ()
    title: str = ""
    across: str = ""
    up: str = ""
    equal: bool = False  # Whether a unit is equally long along both axes
    notes: Sequence[str] = ()  # Below the panel
    bars: Sequence[ScaleBar] = ()  # Scale bars of enlarged marks, below the title
    # Position: `beside`, `above`, `below`, a corner (`upper right` ...), `best` (the emptiest), or empty
    legend: str = ""
    # Names at 0, 1, 2 ... instead of numbers
    across_names: Sequence[str] = ()
    up_names: Sequence[str] = ()
    turned: bool = False  # Whether names across are vertical
    # Without lines of axes; without numbers
    bare: bool = False
    unnumbered: bool = False
    # Logarithmic axes
    log_across: bool = False
    log_up: bool = False
    shades: Shades | None = None  # Colour bar of the panel
    decimal: str = "."  # Decimal sign

    def even(self, places: Floats) -> Floats:
        """Return (..., 2) places as they are spaced: their logarithms along axes that have these."""
        log = np.array([self.log_across, self.log_up])
        return np.where(log, np.log10(np.where(log, places, 1.0)), places) if log.any() else places


@dataclass(frozen=True, eq=False)
class Sketch:
    """A picture: its panels row by row, None where one is empty."""

    # Maximum size, inches
    width: float
    height: float
    panels: Sequence[Panel | None]
    columns: int = 1
    shades: Shades | None = None  # Colour bar of all panels
    shared: bool = False  # Numbers across only below the lowest panel of a column
    title: str = ""

    @property
    def rows(self) -> int:
        """How many rows of panels there are."""
        return -(-len(self.panels) // self.columns)


def spread(*values: Floats | float) -> tuple[float, float]:
    """Return limits with some room around values; values that are not finite do not count."""
    every = np.concatenate([np.ravel(each) for each in values])
    every = every[np.isfinite(every)]
    low, high = (float(every.min()), float(every.max())) if every.size else (0.0, 0.0)
    # As wide as matplotlib has it: a twentieth on either side.
    room = 0.05 * (high - low) or 0.05 * (abs(low) or 1.0)
    return low - room, high + room


def around(places: Floats, part: float = 0.08) -> Floats:
    """Return (2, 2) limits around (n, 2) places with room on all sides, a part of their larger extent."""
    low, high = places.min(axis=0), places.max(axis=0)
    room = part * (float((high - low).max()) or 1.0)
    return np.array([low - room, high + room])
