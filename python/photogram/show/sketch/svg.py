"""A plot written directly as SVG, which is faster than matplotlib."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.show.sketch import layout
from photogram.show.sketch.layout import COLOUR_BAR, GAP, LABEL, LEGEND, LEGEND_LINE, NUMBER, SWATCH, Placed
from photogram.show.sketch.letters import Box, ticks, widest
from photogram.show.sketch.marks import Labelled, Panel, Shades, Sketch, hexadecimal, stops
from photogram.show.sketch.svg_marks import (
    Attributes,
    element,
    names,
    number,
    path,
    place,
    sample,
    svg,
    text,
)
from photogram.show.style import FAINT, INK, SETTINGS

TICK_LENGTH = 3.5
LETTERS = ", ".join([*SETTINGS["font.sans-serif"], "sans-serif"])
NAMED: Attributes = {"font_size": LABEL, "text_anchor": "middle"}


def svg_of(sketch: Sketch, name: str, title: str) -> str:
    """Return a plot as an SVG element; empty without panels.

    Identifiers of its parts begin with `name`; `title` is its text alternative.
    """
    panels = layout.laid_out(sketch)
    if not panels:
        return ""
    parts = [_panel(placed, f"{name}-{k}") for k, placed in enumerate(panels)]
    wide, high = (max(ends) for ends in zip(*(placed.end for placed in panels), strict=True))
    if sketch.shades is not None:
        parts.append(_colour_bar(sketch.shades, f"{name}-shades", panels))
        wide = max(wide, max(placed.right_side for placed in panels) + GAP + COLOUR_BAR)
    if heading := layout.heading(sketch):
        x = min(each.box[0] for each in panels)
        lines = "".join(text(x, layout.HEAD_LINE * (k + 0.75), line) for k, line in enumerate(heading))
        parts.append(element("g", lines, fill=INK, font_size=layout.HEAD))
        wide = max(wide, x + widest(heading, layout.HEAD))
    content = element("g", "".join(parts), font_family=LETTERS, font_size=NUMBER, fill="none")
    size = f'viewBox="0 0 {wide + 2:.0f} {high + 2:.0f}" width="{96 / 72 * (wide + 2):.0f}"'
    head = element("svg", role="img", aria_label=title).removesuffix("/>")
    return f'{head} xmlns="http://www.w3.org/2000/svg" {size}>{content}</svg>'


def _panel(placed: Placed, name: str) -> str:
    panel, (left, _, _, low) = placed.panel, placed.box
    clip = element("clipPath", element("rect", **place(*placed.box)), id=f"{name}-clip")
    marks = "".join(svg(mark, placed) for mark in sorted(panel.marks, key=lambda each: each.layer))
    legend, taken = _legend(placed)
    inside = element("g", marks, clip_path=f"url(#{name}-clip)") if marks else ""
    words = [_axes(placed), _above(placed), legend, names(placed, taken)]
    if placed.notes:
        heights = (low + placed.below + layout.NOTE_LINE * (k + 0.8) for k in range(len(placed.notes)))
        lines = (text(left, y, line) for y, line in zip(heights, placed.notes, strict=True))
        words.append(element("g", "".join(lines), font_size=layout.NOTE))
    bar = _colour_bar(panel.shades, f"{name}-shades", [placed]) if panel.shades else ""
    return clip + inside + element("g", "".join(words), fill=INK) + bar


def _axes(placed: Placed) -> str:
    panel, (left, top, right, low) = placed.panel, placed.box
    x, y = panel.limits[0].tolist()
    over = placed.at(np.column_stack(np.broadcast_arrays(placed.across.values, y)))[:, 0].tolist()
    beside = placed.at(np.column_stack(np.broadcast_arrays(x, placed.up.values)))[:, 1].tolist()
    found = []
    if not panel.bare:
        lines = f"M{number(left)} {number(top)}V{number(low)}H{number(right)}"
        lines += "".join(f"M{number(x)} {number(low)}v{TICK_LENGTH}" for x in over)
        lines += "".join(f"M{number(left)} {number(y)}h-{TICK_LENGTH}" for y in beside)
        found.append(path(lines, fill="none", stroke=FAINT, stroke_width=0.8))
    if placed.numbered:
        found.append(_across(placed, over))
    rows = zip(beside, placed.up.texts, strict=True)
    numbers = "".join(text(left - 6.0, y + 0.36 * NUMBER, each) for y, each in rows)
    found.append(element("g", numbers, text_anchor="end"))
    if panel.across:
        name, down = placed.across.named(panel.across), low + placed.axis_below - 5.0
        found.append(text(0.5 * (left + right), down, name, turned=False, **NAMED))
    if name := placed.up.named(panel.up):
        x, y = left - 12.0 - placed.beside, 0.5 * (top + low)
        found.append(text(x, y, name, turned=True, **NAMED))
    return "".join(found)


def _across(placed: Placed, places: Sequence[float]) -> str:
    rows, low = zip(places, placed.across.texts, strict=True), placed.box[3]
    if not placed.panel.turned:
        level = "".join(text(x, low + NUMBER + 4.0, each) for x, each in rows)
        return element("g", level, text_anchor="middle")
    y = low + 5.0
    turned = "".join(text(x, y, each, turned=True, dy=0.36 * NUMBER) for x, each in rows)
    return element("g", turned, text_anchor="end")


def _above(placed: Placed) -> str:
    panel, (left, top, _, _) = placed.panel, placed.box
    first, found = top - placed.above - 3.0, []
    for k, line in enumerate(placed.title, 1):
        found.append(text(left, first + layout.TITLE_LINE * k, line, font_size=layout.TITLE))
    for row, (length, colour, name) in enumerate(reversed(panel.bars)):
        y, end = top - 8.0 - layout.BAR_LINE * row, left + placed.scale * length
        found.append(path(f"M{number(left)} {number(y)}H{number(end)}", stroke=colour, stroke_width=2.5))
        found.append(text(end + 5.0, y + 0.36 * LEGEND, name, font_size=LEGEND))
    return "".join(found)


def _legend(placed: Placed) -> tuple[str, list[Box]]:
    marks, where = placed.panel.labelled, placed.panel.legend
    if not where or not marks:
        return "", []
    box = placed.legend
    entries = [_entry(mark, box[0], box[1] + LEGEND_LINE * (k + 0.5)) for k, mark in enumerate(marks)]
    if where == "best":
        entries.insert(0, element("rect", **place(*box), fill="white", opacity=0.85))
    return "".join(entries), [box]


def _entry(mark: Labelled, x: float, y: float) -> str:
    """Return a sample of a mark and its name, centred at a height."""
    own = Placed(Panel(np.array([[0.0, 0.0], [SWATCH, 8.0]])), (x, y - 4.0, x + SWATCH, y + 4.0))
    name = text(x + SWATCH + 6.0, y + 0.36 * LEGEND, mark.label, font_size=LEGEND)
    return element("g", svg(sample(mark), own), fill="none") + name


def _colour_bar(shades: Shades, name: str, beside: Sequence[Placed]) -> str:
    """Return a colour bar with numbers, to the right of panels."""
    top, low = min(each.box[1] for each in beside), max(each.box[3] for each in beside)
    left = max(each.right_side for each in beside) + GAP
    right = left + 9.0
    steps = (
        element("stop", offset=where, stop_color=hexadecimal(colour.astype(np.int64)))
        for where, colour in zip(*stops(shades.map), strict=True)
    )
    found = [element("linearGradient", "".join(steps), id=name, x1=0.0, x2=0.0, y1=1.0, y2=0.0)]
    found.append(element("rect", **place(left, top, right, low), fill=f"url(#{name})"))
    ends, decimal = np.array([shades.low, shades.high]), beside[0].panel.decimal
    given = ticks(ends, low - top, NUMBER, across=False, log=shades.log, decimal=decimal)
    heights = low - shades.parts(given.values) * (low - top)
    for y, value in zip(heights.tolist(), given.texts, strict=True):
        found.append(path(f"M{number(right)} {number(y)}h{TICK_LENGTH}", stroke=FAINT, stroke_width=0.8))
        found.append(text(right + 6.0, y + 0.36 * NUMBER, value, fill=INK))
    x, y = left + COLOUR_BAR - 8.0, 0.5 * (top + low)
    found.append(text(x, y, shades.label, turned=True, **NAMED, fill=INK))
    return "".join(found)
