"""Layout of panels: axes, text and legends as marks around boxes that use the rest.

All units are points, from the upper left corner, downwards. Widths of words are estimated, and numbers along
axes chosen, because the layout precedes the drawing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.show.sketch import marks as shapes
from photogram.show.sketch.marks import Line, Mark, Panel, Polygons, Sketch, Texts, boxes
from photogram.show.style import FAINT

# Advance widths of DejaVu Sans 2.37 from space to tilde, in thousandths of the size. It is the widest of the
# fonts of pages, so that the text also fits with the others.
_ASCII = (
    "318 401 460 838 636 950 780 275 390 390 500 838 318 361 318 337 636 636 636 636 636 636 636 636 636 636"
    " 337 337 838 838 838 531 1000 684 686 698 770 632 575 775 752 295 295 656 557 863 748 787 603 787"
    " 695 635 611 732 684 989 685 611 685 390 337 390 838 500 500 613 635 550 635 615 352 635 634 278"
    " 278 579 278 974 634 612 635 635 411 521 392 634 592 818 592 592 525 636 337 636 838"
)
_WIDTHS = {chr(32 + k): int(width) for k, width in enumerate(_ASCII.split())} | dict.fromkeys("±×−", 838)
EAST_ASIAN = "\u2e80"  # First of the letters with a width of 1000; others have 640, approximately


@cache
def width(text: str, size: float) -> float:
    """Return the width of a line of text, in the unit of the letter size."""
    return sum(_WIDTHS.get(sign, 1000 if sign >= EAST_ASIAN else 640) for sign in text) * size / 1000.0


def widest(texts: Sequence[str], size: float) -> float:
    """Return the largest width of some lines; 0 without lines."""
    return max((width(text, size) for text in texts), default=0.0)


def wrapped(text: str, size: float, room: float) -> list[str]:
    """Return lines of a text within a width, broken between words."""
    lines: list[str] = []
    for paragraph in text.split("\n"):
        lines.append("")
        for word in paragraph.split():
            longer = f"{lines[-1]} {word}".lstrip()
            if lines[-1] and width(longer, size) > room:
                lines.append(word)
            else:
                lines[-1] = longer
    return [line for line in lines if line]


MAX_STEPS = 8


class Ticks(NamedTuple):
    """Values along an axis with texts."""

    values: Floats
    texts: list[str]


def ticks(
    limits: Floats, length: float, size: float, *, across: bool = False, log: bool = False, decimal: str = "."
) -> Ticks:
    """Return ticks of an axis with (2,) limits; `length` and `size` in points, `decimal` the decimal sign.

    With `across`, numbers are next to each other. Logarithmic axes have 1, 2, 5 times powers of ten.
    """
    low, high = sorted(limits.tolist())
    for values, step in _candidates(low, high, log):
        places = np.log(values / low) / math.log(high / low) if log else (values - low) / (high - low)
        found = _written(values, step, decimal)
        room = widest(found.texts, size) + 1.6 * size if across else 2.6 * size
        if len(values) > 1 and (np.diff(places) * length > room).all():
            return found
    # A short axis without space for two of these has its ends, or one of them.
    ends = _written(np.unique([low, high]), (high - low) / 100.0, decimal)
    fit = not across or widest(ends.texts, size) + size < length
    return ends if fit else _written(ends.values[:1], (high - low) / 100.0, decimal)


def _candidates(low: float, high: float, log: bool) -> Iterator[tuple[Any, float]]:
    """Yield values between limits with their step, many first; ratios have the step 0."""
    if log:
        powers = 10.0 ** np.arange(math.floor(math.log10(low)), math.floor(math.log10(high)) + 1)
        for steps in ((1.0, 2.0, 5.0), (1.0, 5.0), (1.0,)):
            every = np.outer(powers, steps).ravel()
            yield every[(every >= low * (1 - 1e-9)) & (every <= high * (1 + 1e-9))], 0.0
    least = (high - low) / MAX_STEPS
    power = 10.0 ** math.floor(math.log10(least)) if least > 0 else 0.0
    for step in (factor * power for factor in (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)):
        if step >= least * (1 - 1e-9) > 0:
            yield step * np.arange(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1), step


def _written(values: Floats, step: float, decimal: str) -> Ticks:
    largest = float(np.abs(values).max(initial=0.0))
    decimals = min(max(0, -math.floor(math.log10(step) + 1e-9)), 15) if step > 0 else 0
    layout = f"z.{decimals}f" if step and (largest == 0 or 1e-3 <= largest < 1e8) else "z.10g"
    texts = [f"{value:{layout}}".replace("-", "−").replace(".", decimal) for value in values.tolist()]
    return Ticks(values, texts)


HEAD, TITLE, LABEL, NUMBER, LEGEND, NOTE, NAME = 11.0, 10.0, 9.0, 8.0, 8.0, 7.5, 7.0  # Sizes of letters
LEADING = 1.38  # Distance of lines of text, in sizes of their letters
TICK = 3.5  # Length of the ticks of an axis
SWATCH = 16.0  # Width of the sample of a mark in a legend
SIDES = ((0, 0), (2, 2), (2, 0), (0, 2), (0, 1), (2, 1), (1, 0), (1, 2))  # Of a point, in the order of trial
GAP = 8.0  # Between unrelated items
COLOUR_BAR = 62.0  # Width of a colour bar with its numbers and name
MIN_SIDE = 40.0  # Of a box

Box: TypeAlias = tuple[float, float, float, float]  # Left, upper, right and lower side


@dataclass(frozen=True, eq=False)
class Placed:
    """A panel and its position."""

    panel: Panel
    box: Box  # Left, upper, right and lower side of the area between the axes
    across: Ticks = Ticks(np.empty(0), [])  # Ticks of the axes
    up: Ticks = Ticks(np.empty(0), [])
    frame: Sequence[Mark] = ()  # Axes, text, legend and colour bar, in points
    sides: Box = (0.0, 0.0, 0.0, 0.0)  # Widths and heights that these require around the box

    def at(self, places: Floats) -> Floats:
        """Return (..., 2) positions in the units of the axes as points of the plot."""
        left, top, right, low = self.box
        first, last = self.panel.even(self.panel.limits)
        part = (self.panel.even(places) - first) / (last - first)
        found: Floats = [left, low] + part * [right - left, top - low]
        return found

    @property
    def ends(self) -> tuple[float, float]:
        """The right and the lower end of the panel with all its text."""
        parts, rights = {"start": 1.0, "middle": 0.5, "end": 0.0}, [self.box[2] + self.sides[2]]
        for mark in self.frame:
            if isinstance(mark, Texts) and not mark.turned:
                sizes = np.array([parts[mark.anchor] * width(text, mark.size) for text in mark.texts])
                rights += (mark.places[:, 0] + sizes).tolist()
        return max(rights), self.box[3] + self.sides[3]


POINTS = Placed(Panel(np.array([[0.0, 1e4], [1e4, 0.0]])), (0.0, 0.0, 1e4, 1e4))  # Of marks in points


def laid_out(sketch: Sketch) -> list[Placed]:
    """Return the panels of a plot with their positions; the first has the heading of the plot."""
    there = [k for k, panel in enumerate(sketch.panels) if panel is not None]
    panels = [_opened(panel) for panel in sketch.panels if panel is not None]
    if not panels:
        return []
    rows, columns = np.divmod(there, sketch.columns)
    shown = (not sketch.shared) | (rows == _largest(columns, rows)[columns])
    whole_wide, whole_high = 72.0 * sketch.width, 72.0 * sketch.height
    heading = wrapped(sketch.title, HEAD, whole_wide - GAP)
    head, wide, high = LEADING * HEAD * len(heading), whole_wide / sketch.columns, whole_high / sketch.rows
    guess, room = (0.0, 0.0, 0.75 * wide, high), 0.8 * wide
    sides = [_framed(panel, guess, room, own).sides for panel, own in zip(panels, shown, strict=True)]
    lefts, rights = (_largest(columns, [own[k] for own in sides]) for k in (0, 2))
    tops, belows = (_largest(rows, [own[k] for own in sides]) for k in (1, 3))
    wide = max((whole_wide - lefts.sum() - rights.sum()) / sketch.columns, MIN_SIDE)
    high = max((whole_high - head - tops.sum() - belows.sum()) / sketch.rows, MIN_SIDE)
    extents = np.array([np.abs(panel.limits[1] - panel.limits[0]) for panel in panels])
    equal = extents * np.min([wide, high] / extents, axis=1, keepdims=True)
    sizes = np.where([[panel.equal] for panel in panels], equal, [wide, high])
    heights = _largest(rows, sizes[:, 1])  # Panels lower than the available height do not leave a gap
    left = np.cumsum(lefts + rights + wide) - rights - wide
    top = head + np.cumsum(tops + belows + heights) - belows - heights
    corners = np.column_stack([left[columns], top[rows]])
    places = np.hstack([corners, corners + sizes]).tolist()
    cells = zip(panels, places, shown, lefts[columns].tolist(), strict=True)
    found = [_framed(panel, tuple(box), room, own, margin) for panel, box, own, margin in cells]
    title = _lines(corners[:, 0].min(), 0.5 * LEADING * HEAD, heading, HEAD)
    return [replace(found[0], frame=[title, *found[0].frame]), *found[1:]]


def _framed(panel: Panel, box: Box, room: float, numbered: bool, margin: float = 0.0) -> Placed:
    """Compose what is around a box: texts within `room`, and the name of its axis at the left `margin`."""
    (left, top, right, low), above = box, box[1] - 8.0
    sides = ((panel.across_names, right - left, panel.log_across), (panel.up_names, low - top, panel.log_up))
    across, up = (
        Ticks(np.arange(len(names), dtype=float), list(names))
        if names or panel.bare
        else ticks(panel.limits[:, axis], length, NUMBER, across=axis == 0, log=log, decimal=panel.decimal)
        for axis, (names, length, log) in enumerate(sides)
    )
    placed = Placed(panel, box, across, up)
    marks, wide, down = _axes(placed, margin, numbered)
    side, foot = right + (0.0 if panel.across_names else 0.5 * widest(across.texts, NUMBER)), down
    if panel.legend == "beside" and panel.labelled:
        entries, (side, foot) = _legend(panel, right + GAP, top)
        marks += entries
    elif panel.legend and panel.labelled:
        entries, (_, down) = _legend(panel, left, down)
        marks += entries
    if panel.shades:
        marks += _colour_bar(panel.shades, side + GAP, top, low, panel.decimal)
        side += COLOUR_BAR
    notes = [line for note in panel.notes for line in wrapped(note, NOTE, room)]
    marks.append(_lines(left, down + 0.5 * LEADING * NOTE, notes, NOTE))
    down = max(down + LEADING * NOTE * len(notes), foot) + GAP
    scale = (right - left) / float(abs(panel.limits[1, 0] - panel.limits[0, 0]))
    for length, colour, meaning in reversed(panel.bars):
        end = left + scale * length
        marks += [Line(_at([left, end], above), colour, 2.5), _lines(end + 5.0, above, [meaning], LEGEND)]
        above -= LEADING * LEGEND
    title = wrapped(panel.title, TITLE, room)
    above -= LEADING * TITLE * len(title)
    marks.append(_lines(left, above + LEADING * TITLE - 4.0, title, TITLE))
    return replace(placed, frame=marks, sides=(wide, top - above - 2.0, side + GAP - right, down - low))


def _axes(placed: Placed, margin: float, numbered: bool) -> tuple[list[Mark], float, float]:
    """Return axes with ticks, numbers and names; the width at the left, and the lower end."""
    panel, (left, top, right, low) = placed.panel, placed.box
    x = placed.at(_at(placed.across.values, panel.limits[0, 1]))[:, 0]
    y = placed.at(_at(panel.limits[0, 0], placed.up.values))[:, 1]
    numbers, wide, down = placed.across.texts, widest(placed.up.texts, NUMBER) + 7.0, low + 3.0
    found: list[Mark] = [Texts(_at(left - 6.0, y), placed.up.texts, NUMBER, anchor="end")]
    if not panel.bare:
        ticks_across = np.stack([_at(x, low), _at(x, low + TICK)], axis=1)
        ticks_up = np.stack([_at(left, y), _at(left - TICK, y)], axis=1)
        sides = np.array([[left, top], [left, low], [right, low]])
        found.append(Line([sides, *ticks_across, *ticks_up], FAINT, 0.8))
    if panel.up:
        wide = margin or wide + LABEL + 6.0
        at = _at(left - wide + 6.8, (top + low) / 2)
        found.append(Texts(at, [panel.up], LABEL, anchor="middle", turned=True))
    if numbered and panel.turned:
        found.append(Texts(_at(x, low + 5.0), numbers, NUMBER, anchor="end", turned=True))
        down += 5.0 + widest(numbers, NUMBER)
    elif numbered:
        found.append(Texts(_at(x, low + 9.1), numbers, NUMBER, anchor="middle"))
        down += NUMBER + 7.0
    if panel.across:
        down += LABEL + 5.0
        found.append(Texts(_at((left + right) / 2, down - 8.2), [panel.across], LABEL, anchor="middle"))
    return found, wide, down


def _legend(panel: Panel, left: float, top: float) -> tuple[list[Mark], tuple[float, float]]:
    """Return a legend, one mark per line, and its right and lower end with a margin."""
    names, line = [mark.label for mark in panel.labelled], LEADING * LEGEND
    found = [_sample(mark, _at(left, top + line * (k + 0.5))) for k, mark in enumerate(panel.labelled)]
    beside = left + SWATCH + 6.0
    found.append(_lines(beside, top + 0.5 * line, names, LEGEND))
    return found, (beside + widest(names, LEGEND) + GAP, top + line * len(names) + GAP / 2)


def _sample(mark: Mark, left: Floats) -> Mark:
    """Return the sample of a mark for a legend, to the right of a point."""
    line, aside = left + np.array([[0.0, 0.0], [SWATCH, 0.0]]), np.array([0.0, 3.0])
    match mark:
        case shapes.Markers():
            return replace(mark, places=line.mean(axis=0)[None], size=max(mark.size, 4.0), values=None)
        case shapes.Arrows():
            return replace(mark, places=line[:1], vectors=line[1:] - line[:1], width=1.3e-4)
        case Polygons():
            return replace(mark, places=boxes(line[:1] - aside, line[1:] + aside))
        case Line():
            return replace(mark, places=line)
    raise TypeError(f"the legend does not draw {type(mark).__name__}")


def _colour_bar(shades: shapes.Shades, left: float, top: float, low: float, decimal: str) -> list[Mark]:
    """Return a colour bar with numbers and its name at the right."""
    right, colours = left + 9.0, shades.values((np.arange(64) + 0.5) / 64)
    values = ticks(np.array([shades.low, shades.high]), low - top, NUMBER, log=shades.log, decimal=decimal)
    y = low - shades.parts(values.values) * (low - top)
    name = _at(left + COLOUR_BAR - 11.0, (top + low) / 2)
    return [
        shapes.Mesh(np.array([[left, low], [right, top]]), colours[:, np.newaxis], shades),
        Line(np.stack([_at(right, y), _at(right + TICK, y)], axis=1), FAINT, 0.8),
        Texts(_at(right + 6.0, y), values.texts, NUMBER),
        Texts(name, [shades.label], LABEL, anchor="middle", turned=True),
    ]


def _at(x: Any, y: Any) -> Floats:
    return np.column_stack(np.broadcast_arrays(x, y))


def _lines(left: float, y: float, texts: Sequence[str], size: float) -> Texts:
    """Return lines of text, the first at a height."""
    return Texts(_at(left, y + LEADING * size * np.arange(len(texts))), texts, size)


def free_names(
    mark: shapes.Names, at: Floats, avoid: Floats, size: float, room: Box, taken: list[Box]
) -> Iterator[tuple[int, Box]]:
    """Yield rows and boxes of names that fit at one of eight sides of their points, or at their centre.

    Boxes are within `room`. They cover none of the points `at` (unless centred) and `avoid`, and none of the
    boxes `taken`, to which they are added. `size` is the letter size; y increases upwards.
    """
    obstacles = avoid if mark.centred else np.concatenate([at, avoid])
    gap, high = 4.0 / 7.0 * size, 8.0 / 7.0 * size
    for row, (text, (x, y)) in enumerate(zip(mark.texts, at.tolist(), strict=True)):
        wide = width(text, size) + 0.8 / 7.0 * size
        across, up = (x + gap, x - wide / 2, x - gap - wide), (y + gap, y - high / 2, y - gap - high)
        for i, j in ((1, 1),) if mark.centred else SIDES:
            box = left, low, right, top = across[i], up[j], across[i] + wide, up[j] + high
            inside = room[0] <= left and right <= room[2] and room[1] <= low and top <= room[3]
            if not inside or ((obstacles > [left, low]) & (obstacles < [right, top])).all(axis=1).any():
                continue
            if all(right <= a or c <= left or top <= b or d <= low for a, b, c, d in taken):
                taken.append(box)
                yield row, box
                break


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
