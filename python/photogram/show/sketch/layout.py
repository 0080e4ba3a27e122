"""Where the panels of a picture go: margins come from the widths of words, and boxes have what is left.

All in points, from the upper left corner, downwards.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.show.sketch.letters import Box, Ticks, ticks, widest, width, wrapped
from photogram.show.sketch.marks import Labelled, Level, Line, Markers, Panel, Polygons, Sketch

HEAD, TITLE, LABEL, NUMBER, LEGEND, NOTE, NAME = 11.0, 10.0, 9.0, 8.0, 8.0, 7.5, 7.0  # Sizes of letters
HEAD_LINE, TITLE_LINE, NOTE_LINE, LEGEND_LINE, BAR_LINE = 15.0, 13.0, 9.6, 11.5, 12.0
SWATCH = 16.0  # Width of the sample of a mark in a legend
GAP = 8.0  # Between unrelated things
COLOUR_BAR = 62.0  # Width of a bar of colours with its numbers and name
MIN_SIDE = 40.0  # Of a box


@dataclass(frozen=True, eq=False)
class Placed:
    """A panel and where it goes."""

    panel: Panel
    box: Box  # Left, upper, right and lower side of the area between the axes
    # Ticks of the axes; `numbered`: whether the axis across has its numbers
    across: Ticks
    up: Ticks
    numbered: bool
    # Lines of title and notes
    title: list[str]
    notes: list[str]
    # Width of the numbers at the left of all panels of its column
    beside: float = 0.0

    def at(self, places: Floats) -> Floats:
        """Return (..., 2) places in the units of the axes as points of the picture."""
        left, top, right, low = self.box
        first, last = self.panel.even(self.panel.limits)
        part = (self.panel.even(places) - first) / (last - first)
        found: Floats = [left, low] + part * [right - left, top - low]
        return found


def legend_size(marks: list[Labelled]) -> tuple[float, float]:
    """Return width and height of a legend of marks below each other."""
    return SWATCH + 6.0 + widest([mark.label for mark in marks], LEGEND), LEGEND_LINE * len(marks)


def labelled(panel: Panel) -> list[Labelled]:
    """Return the marks that stand in the legend."""
    return [mark for mark in panel.marks if isinstance(mark, Labelled) and mark.label]


def heading(sketch: Sketch) -> list[str]:
    """Return the lines of the title of all panels."""
    return wrapped(sketch.title, HEAD, 72.0 * sketch.width - GAP)


def named_axis(name: str, power: str) -> str:
    """Return the name of an axis with the power of ten of its numbers."""
    return f"{name} (× {power})".strip() if power else name


def laid_out(sketch: Sketch) -> list[Placed]:
    """Return the panels of a picture with their places."""
    there = [(k, each) for k, each in enumerate(sketch.panels) if each is not None]
    cells = [(*divmod(k, sketch.columns), _opened(panel)) for k, panel in there]
    lefts, rights, wide = _columns(sketch, cells)
    lowest = {column: row for row, column, _ in cells}
    head = HEAD_LINE * len(heading(sketch))
    tops, belows, said = [0.0] * sketch.rows, [0.0] * sketch.rows, list[tuple[bool, list[str], list[str]]]()
    for row, column, panel in cells:
        room = wide + rights[column] - GAP
        numbered = not sketch.shared or lowest[column] == row
        title = wrapped(panel.title, TITLE, room)
        notes = [line for each in panel.notes for line in wrapped(each, NOTE, room)]
        said.append((numbered, title, notes))
        tops[row] = max(tops[row], above(panel, title))
        belows[row] = max(belows[row], below(panel, numbered) + NOTE_LINE * len(notes) + GAP)
    high = max((72.0 * sketch.height - head - sum(tops) - sum(belows)) / sketch.rows, MIN_SIDE)
    sizes = [_size(panel, wide, high) for *_, panel in cells]
    # Panels that are lower than there is room leave none of it between them.
    heights = [0.0] * sketch.rows
    for (row, *_), size in zip(cells, sizes, strict=True):
        heights[row] = max(heights[row], size[1])
    found = []
    for (row, column, panel), size, (numbered, title, notes) in zip(cells, sizes, said, strict=True):
        left = sum(lefts[: column + 1]) + sum(rights[:column]) + column * wide
        top = head + sum(tops[: row + 1]) + sum(belows[:row]) + sum(heights[:row])
        box = (left, top, left + size[0], top + size[1])
        across, up = _ticks(panel, *size)
        found.append(Placed(panel, box, across, up, numbered, title, notes))
    columns = [column for _, column, _ in cells]
    widths = [0.0] * sketch.columns
    for column, placed in zip(columns, found, strict=True):
        widths[column] = max(widths[column], widest(placed.up.texts, NUMBER))
    return [replace(each, beside=widths[column]) for column, each in zip(columns, found, strict=True)]


def _opened(panel: Panel) -> Panel:
    """Return a panel whose limits are apart: of one value they are a little beside it."""
    first, last = panel.limits
    room = np.where(first == last, 1e-6 * np.maximum(np.abs(first), 1.0), 0.0)
    return replace(panel, limits=np.stack([first - room, last + room])) if room.any() else panel


def _columns(
    sketch: Sketch, cells: Sequence[tuple[int, int, Panel]]
) -> tuple[list[float], list[float], float]:
    """Return the margins of each column, and what is between them of each."""
    numbers, named, rights = ([each] * sketch.columns for each in (0.0, 0.0, GAP))
    for _, column, panel in cells:
        sides = _sides(panel, 72.0 * sketch.width / sketch.columns, 72.0 * sketch.height / sketch.rows)
        for known, own in zip((numbers, named, rights), sides, strict=True):
            known[column] = max(known[column], own)
    lefts = [one + other for one, other in zip(numbers, named, strict=True)]
    beside = sum(lefts) + sum(rights) + (COLOUR_BAR if sketch.shades else 0.0)
    return lefts, rights, max((72.0 * sketch.width - beside) / sketch.columns, MIN_SIDE)


def above(panel: Panel, title: list[str]) -> float:
    """Return how high what stands over a box is: title, legend, bars."""
    legend = LEGEND_LINE if panel.legend == "above" else 0.0
    return 6.0 + TITLE_LINE * len(title) + legend + BAR_LINE * len(panel.bars)


def below(panel: Panel, numbered: bool) -> float:
    """Return how high what stands below a box is, down to its notes: axis and legend."""
    legend = LEGEND_LINE * len(labelled(panel)) + GAP / 2 if panel.legend == "below" else 0.0
    return below_axis(panel, numbered) + legend


def below_axis(panel: Panel, numbered: bool) -> float:
    """Return how high numbers and the name of the axis below a box are."""
    numbers = 0.0
    if numbered:
        turned = widest(panel.across_names, NUMBER) if panel.turned else 0.0
        numbers = 5.0 + max(turned, NUMBER + 2.0)
    return numbers + (LABEL + 5.0 if panel.across else 0.0) + 3.0


def _sides(panel: Panel, wide: float, high: float) -> tuple[float, float, float]:
    """Return how much room numbers, names at the left and what is at the right need in a cell of a size."""
    across, up = _ticks(panel, 0.75 * wide, high)
    numbers = widest(up.texts, NUMBER) + 7.0
    named = LABEL + 6.0 if named_axis(panel.up, up.power) else 0.0
    right = GAP + (0.0 if panel.across_names else 0.5 * widest(across.texts, NUMBER))
    if panel.legend == "beside":
        right = GAP + legend_size(labelled(panel))[0] + GAP
    return numbers, named, right + COLOUR_BAR if panel.shades else right


def _ticks(panel: Panel, wide: float, high: float) -> tuple[Ticks, Ticks]:
    if panel.unnumbered:
        return Ticks(np.empty(0), []), Ticks(np.empty(0), [])
    found = []
    sides = ((panel.across_names, wide, panel.log_across), (panel.up_names, high, panel.log_up))
    for axis, (names, length, log) in enumerate(sides):
        if names:
            found.append(Ticks(np.arange(len(names), dtype=float), list(names)))
        else:
            own = ticks(panel.limits[:, axis], length, NUMBER, across=axis == 0, log=log)
            found.append(own.signed(panel.decimal))
    return found[0], found[1]


def _size(panel: Panel, wide: float, high: float) -> tuple[float, float]:
    """Return width and height of a box that may be so wide and high."""
    if not panel.equal:
        return wide, high
    across, up = np.abs(panel.limits[1] - panel.limits[0]).tolist()
    scale = min(wide / across, high / up)
    return scale * across, scale * up


def legend_box(placed: Placed) -> Box:
    """Return left, upper, right and lower side of the legend of a panel."""
    left, top, right, low = placed.box
    wide, high = legend_size(labelled(placed.panel))
    inner = GAP / 2
    corners = {
        "upper right": (right - wide - inner, top + inner),
        "upper left": (left + inner, top + inner),
        "lower left": (left + inner, low - high - inner),
        "lower right": (right - wide - inner, low - high - inner),
        "beside": (right + GAP, top),
        "below": (left, low + below_axis(placed.panel, placed.numbered)),
    }
    where = placed.panel.legend
    if where == "best":
        curves = [placed.at(each) for each in _curves(placed.panel)]
        del corners["beside"], corners["below"]
        where = min(corners, key=lambda name: _inside(curves, (*corners[name], wide, high)))
    x, y = corners[where]
    return x, y, x + wide, y + high


def _curves(panel: Panel) -> list[Floats]:
    """Return (n, 2) places on what a legend should not hide."""
    found: list[Floats] = []
    for mark in panel.marks:
        if isinstance(mark, (Line, Markers, Polygons)):
            found.append(mark.places.reshape(-1, 2))
        elif isinstance(mark, Level):
            left, right = panel.limits[:, 0].tolist()
            found.append(np.column_stack([np.linspace(left, right, 60), np.full(60, mark.height)]))
    return found


def _inside(curves: list[Floats], box: Box) -> int:
    x, y, wide, high = box
    return sum(int(((each > [x, y]) & (each < [x + wide, y + high])).all(axis=1).sum()) for each in curves)


def right_side(placed: Placed) -> float:
    """Return the right side of a panel, or of the legend beside it."""
    return legend_box(placed)[2] if placed.panel.legend == "beside" else placed.box[2]


def right_end(placed: Placed) -> float:
    """Return how far to the right anything of a panel reaches."""
    left, _, right, _ = placed.box
    panel = placed.panel
    ends = [right + 0.5 * widest(placed.across.texts[-1:], NUMBER), left + widest(placed.title, TITLE)]
    ends.append(left + widest(placed.notes, NOTE))
    ends.append(left + legend_size(labelled(panel))[0] if panel.legend == "below" else 0.0)
    ends.append(0.5 * (left + right + width(named_axis(panel.across, placed.across.power), LABEL)))
    ends.append(right_side(placed) + (GAP + COLOUR_BAR if panel.shades else 0.0))
    scale = (right - left) / abs(panel.limits[1, 0] - panel.limits[0, 0])
    ends += [left + scale * length + 5.0 + width(text, LEGEND) for length, _, text in panel.bars]
    return max(ends)


def low_end(placed: Placed) -> float:
    """Return how far down anything of a panel reaches."""
    end = placed.box[3] + below(placed.panel, placed.numbered) + NOTE_LINE * len(placed.notes)
    return max(end, legend_box(placed)[3]) if placed.panel.legend == "beside" else end
