"""Layout of panels: margins follow from text widths, boxes use the rest.

All units are points, from the upper left corner, downwards.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.show.sketch.letters import Box, Ticks, ticks, widest, width, wrapped
from photogram.show.sketch.marks import Line, Markers, Panel, Polygons, Sketch

HEAD, TITLE, LABEL, NUMBER, LEGEND, NOTE, NAME = 11.0, 10.0, 9.0, 8.0, 8.0, 7.5, 7.0  # Sizes of letters
HEAD_LINE, TITLE_LINE, NOTE_LINE, LEGEND_LINE, BAR_LINE = 15.0, 13.0, 9.6, 11.5, 12.0
SWATCH = 16.0  # Width of the sample of a mark in a legend
GAP = 8.0  # Between unrelated items
COLOUR_BAR = 62.0  # Width of a colour bar with its numbers and name
MIN_SIDE = 40.0  # Of a box
NO_TICKS = Ticks(np.empty(0), [])


@dataclass(frozen=True, eq=False)
class Placed:
    """A panel and its position."""

    panel: Panel
    box: Box = (0.0, 0.0, 0.0, 0.0)  # Left, upper, right and lower side of the area between the axes
    # Ticks of the axes; `numbered`: whether the horizontal axis has numbers
    across: Ticks = NO_TICKS
    up: Ticks = NO_TICKS
    numbered: bool = False
    # Lines of title and notes
    title: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    # Width of the numbers at the left of all panels in its column
    beside: float = 0.0

    def at(self, places: Floats) -> Floats:
        """Return (..., 2) positions in the units of the axes as points of the plot."""
        left, top, right, low = self.box
        first, last = self.panel.even(self.panel.limits)
        part = (self.panel.even(places) - first) / (last - first)
        found: Floats = [left, low] + part * [right - left, top - low]
        return found

    @property
    def scale(self) -> float:
        return (self.box[2] - self.box[0]) / float(abs(self.panel.limits[1, 0] - self.panel.limits[0, 0]))

    @property
    def above(self) -> float:
        """Height of title and bars over the box."""
        return 6.0 + TITLE_LINE * len(self.title) + BAR_LINE * len(self.panel.bars)

    @property
    def axis_below(self) -> float:
        """Height of the numbers and of the name of the axis below the box."""
        panel, numbers = self.panel, 0.0
        if self.numbered:
            turned = widest(panel.across_names, NUMBER) if panel.turned else 0.0
            numbers = 5.0 + max(turned, NUMBER + 2.0)
        return numbers + (LABEL + 5.0 if panel.across else 0.0) + 3.0

    @property
    def below(self) -> float:
        """Height of axis and legend below the box, down to its notes."""
        return self.axis_below + (self.legend_size[1] + GAP / 2 if self.panel.legend == "below" else 0.0)

    @property
    def legend_size(self) -> tuple[float, float]:
        """Width and height of a legend with one mark per line."""
        labels = [mark.label for mark in self.panel.labelled]
        return SWATCH + 6.0 + widest(labels, LEGEND), LEGEND_LINE * len(labels)

    @property
    def legend(self) -> Box:
        """Left, upper, right and lower side of the legend: outside the box, or in its emptiest corner."""
        (left, top, right, low), (wide, high) = self.box, self.legend_size
        if self.panel.legend in ("beside", "below"):
            x, y = (right + GAP, top) if self.panel.legend == "beside" else (left, low + self.axis_below)
            return x, y, x + wide, y + high
        curves = self.at(np.concatenate([np.empty((0, 2)), *_curves(self.panel)]))
        inner = left + GAP / 2, top + GAP / 2, right - wide - GAP / 2, low - high - GAP / 2
        corners = [(x, y) for y in (inner[1], inner[3]) for x in (inner[2], inner[0])]
        x, y = min(corners, key=lambda corner: _inside(curves, corner, self.legend_size))
        return x, y, x + wide, y + high

    @property
    def right_side(self) -> float:
        """Right side of the box, or of the legend beside it."""
        return self.legend[2] if self.panel.legend == "beside" else self.box[2]

    @property
    def end(self) -> tuple[float, float]:
        """Right and lower limit of the panel with all its text."""
        (left, _, right, low), panel = self.box, self.panel
        ends = [
            left + max(widest(self.title, TITLE), widest(self.notes, NOTE)),
            right + 0.5 * widest(self.across.texts[-1:], NUMBER),
            0.5 * (left + right + width(self.across.named(panel.across), LABEL)),
            self.right_side + (GAP + COLOUR_BAR if panel.shades else 0.0),
            left + self.legend_size[0] if panel.legend == "below" else 0.0,
            *(left + self.scale * length + 5.0 + width(text, LEGEND) for length, _, text in panel.bars),
        ]
        down = low + self.below + NOTE_LINE * len(self.notes)
        return max(ends), max(down, self.legend[3]) if panel.legend == "beside" else down


def heading(sketch: Sketch) -> list[str]:
    return wrapped(sketch.title, HEAD, 72.0 * sketch.width - GAP)


def laid_out(sketch: Sketch) -> list[Placed]:
    """Return the panels of a plot with their positions."""
    panels = [_opened(panel) for panel in sketch.panels if panel is not None]
    if not panels:
        return []
    there = [k for k, panel in enumerate(sketch.panels) if panel is not None]
    rows, columns = np.divmod(there, sketch.columns)
    whole_wide, whole_high = 72.0 * sketch.width, 72.0 * sketch.height
    sides = [_sides(panel, whole_wide / sketch.columns, whole_high / sketch.rows) for panel in panels]
    numbers, names, rights = (_largest(columns, own) for own in np.transpose(sides))
    lefts, bar = numbers + names, COLOUR_BAR if sketch.shades else 0.0
    wide = max((whole_wide - lefts.sum() - rights.sum() - bar) / sketch.columns, MIN_SIDE)
    found = []
    for panel, row, column in zip(panels, rows, columns, strict=True):
        room = wide + float(rights[column]) - GAP
        notes = tuple(line for note in panel.notes for line in wrapped(note, NOTE, room))
        numbered = not sketch.shared or row == rows[columns == column].max()
        title = tuple(wrapped(panel.title, TITLE, room))
        found.append(Placed(panel, numbered=bool(numbered), title=title, notes=notes))
    head = HEAD_LINE * len(heading(sketch))
    tops = _largest(rows, [each.above for each in found])
    belows = _largest(rows, [each.below + NOTE_LINE * len(each.notes) + GAP for each in found])
    high = max((whole_high - head - tops.sum() - belows.sum()) / sketch.rows, MIN_SIDE)
    sizes = np.array([_size(panel, wide, high) for panel in panels])
    heights = _largest(rows, sizes[:, 1])  # Panels lower than the available height do not leave a gap
    left = np.cumsum(lefts + rights + wide) - rights - wide
    top = head + np.cumsum(tops + belows + heights) - belows - heights
    corners = np.column_stack([left[columns], top[rows]])
    boxes = np.hstack([corners, corners + sizes]).tolist()
    axes = [_ticks(panel, *size) for panel, size in zip(panels, sizes.tolist(), strict=True)]
    besides = _largest(columns, [widest(up.texts, NUMBER) for _, up in axes])[columns].tolist()
    return [
        replace(each, box=tuple(box), across=across, up=up, beside=beside)
        for each, box, (across, up), beside in zip(found, boxes, axes, besides, strict=True)
    ]


def _largest(groups: Any, values: Any) -> Floats:
    """Return the largest value of each group, 0 for empty groups."""
    found = np.zeros(groups.max() + 1)
    np.maximum.at(found, groups, values)
    return found


def _opened(panel: Panel) -> Panel:
    """Return a panel with different limits; equal ones are extended slightly."""
    first, last = panel.limits
    room = np.where(first == last, 1e-6 * np.maximum(np.abs(first), 1.0), 0.0)
    return replace(panel, limits=np.stack([first - room, last + room])) if room.any() else panel


def _sides(panel: Panel, wide: float, high: float) -> tuple[float, float, float]:
    """Return widths of numbers, left names and right elements of a cell."""
    across, up = _ticks(panel, 0.75 * wide, high)
    named = LABEL + 6.0 if up.named(panel.up) else 0.0
    right = GAP + (0.0 if panel.across_names else 0.5 * widest(across.texts, NUMBER))
    if panel.legend == "beside":
        right = GAP + Placed(panel).legend_size[0] + GAP
    return widest(up.texts, NUMBER) + 7.0, named, right + COLOUR_BAR if panel.shades else right


def _ticks(panel: Panel, wide: float, high: float) -> tuple[Ticks, Ticks]:
    if panel.unnumbered:
        return NO_TICKS, NO_TICKS
    sides = ((panel.across_names, wide, panel.log_across), (panel.up_names, high, panel.log_up))
    across, up = (
        Ticks(np.arange(len(names), dtype=float), list(names))
        if names
        else ticks(panel.limits[:, axis], length, NUMBER, across=axis == 0, log=log, decimal=panel.decimal)
        for axis, (names, length, log) in enumerate(sides)
    )
    return across, up


def _size(panel: Panel, wide: float, high: float) -> tuple[float, float]:
    if not panel.equal:
        return wide, high
    across, up = np.abs(panel.limits[1] - panel.limits[0]).tolist()
    scale = min(wide / across, high / up)
    return scale * across, scale * up


def _curves(panel: Panel) -> list[Floats]:
    """Return (n, 2) points that a legend should not cover; straight lines have points between their ends."""
    ends, found = np.sort(panel.limits, axis=0), list[Floats]()
    for mark in panel.marks:
        if isinstance(mark, Line):
            lines = (np.clip(line, *ends) for line in mark.lines)
            found += [np.linspace(line[0], line[-1], 60) if len(line) == 2 else line for line in lines]
        elif isinstance(mark, Markers):
            found.append(mark.places)
        elif isinstance(mark, Polygons):
            found.extend(mark.places)
    return found


def _inside(places: Floats, corner: tuple[float, float], size: tuple[float, float]) -> int:
    return int(((places > corner) & (places < np.add(corner, size))).all(axis=1).sum())
