"""A picture straight as SVG, without matplotlib: the page of a block is there in a moment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.show.sketch.layout import (
    BAR_LINE,
    COLOUR_BAR,
    GAP,
    HEAD,
    HEAD_LINE,
    LABEL,
    LEGEND,
    LEGEND_LINE,
    NOTE,
    NOTE_LINE,
    NUMBER,
    SWATCH,
    TITLE,
    TITLE_LINE,
    Placed,
    above,
    below,
    below_axis,
    heading,
    labelled,
    laid_out,
    legend_box,
    low_end,
    named_axis,
    right_end,
    right_side,
)
from photogram.show.sketch.letters import Box, Ticks, ticks, widest, width
from photogram.show.sketch.marks import Labelled, Panel, Shades, Sketch, hexadecimal, stops
from photogram.show.sketch.svg_marks import (
    Attributes,
    element,
    levels_written,
    names,
    number,
    path,
    sample,
    svg,
    text,
)
from photogram.show.style import FAINT, INK, SETTINGS

TICK_LENGTH = 3.5
LETTERS = ", ".join([*SETTINGS["font.sans-serif"], "sans-serif"])


def svg_of(sketch: Sketch, name: str, title: str) -> str:
    """Return a picture as an SVG element; empty without panels.

    Identifiers of its parts begin with `name`; `title` describes it for readers who cannot see it.
    """
    panels = laid_out(sketch)
    if not panels:
        return ""
    parts = [_panel(placed, f"{name}-{k}") for k, placed in enumerate(panels)]
    wide, high = max(map(right_end, panels)), max(map(low_end, panels))
    if sketch.shades is not None:
        parts.append(_colour_bar(sketch.shades, f"{name}-shades", panels))
        wide = max(wide, max(map(right_side, panels)) + GAP + COLOUR_BAR)
    if said := heading(sketch):
        x = min(each.box[0] for each in panels)
        lines = "".join(text(x, HEAD_LINE * (k + 0.75), each) for k, each in enumerate(said))
        parts.append(element("g", {"fill": INK, "font_size": HEAD}, lines))
        wide = max(wide, x + widest(said, HEAD))
    look: Attributes = {"font_family": LETTERS, "font_size": NUMBER, "fill": "none"}
    size = f'viewBox="0 0 {wide + 2:.0f} {high + 2:.0f}" width="{96 / 72 * (wide + 2):.0f}"'
    head = element("svg", {"role": "img", "aria_label": title}).removesuffix("/>")
    return f'{head} xmlns="http://www.w3.org/2000/svg" {size}>{element("g", look, "".join(parts))}</svg>'


def _panel(placed: Placed, name: str) -> str:
    left, top, right, low = placed.box
    window: Attributes = {"x": left, "y": top, "width": right - left, "height": low - top}
    clip = element("clipPath", {"id": f"{name}-clip"}, element("rect", window))
    marks = "".join(svg(mark, placed) for mark in sorted(placed.panel.marks, key=lambda each: each.layer))
    legend, taken = _legend(placed)
    inside = element("g", {"clip_path": f"url(#{name}-clip)"}, marks) if marks else ""
    written = levels_written(placed, taken)
    words = [_axes(placed), _above(placed), written, legend, names(placed, taken), _notes(placed)]
    bar = _colour_bar(placed.panel.shades, f"{name}-shades", [placed]) if placed.panel.shades else ""
    return clip + inside + element("g", {"fill": INK}, "".join(words)) + bar


def _axes(placed: Placed) -> str:
    panel, (left, top, right, low) = placed.panel, placed.box
    over = placed.at(
        np.column_stack([placed.across.values, np.full(len(placed.across.values), panel.limits[0, 1])])
    )
    beside = placed.at(
        np.column_stack([np.full(len(placed.up.values), panel.limits[0, 0]), placed.up.values])
    )
    found = []
    if not panel.bare:
        lines = f"M{number(left)} {number(top)}V{number(low)}H{number(right)}"
        lines += "".join(f"M{x:.2f} {low:.2f}v{TICK_LENGTH}" for x in over[:, 0].tolist())
        lines += "".join(f"M{left:.2f} {y:.2f}h-{TICK_LENGTH}" for y in beside[:, 1].tolist())
        found.append(path(lines, fill="none", stroke=FAINT, stroke_width=0.8))
    if placed.numbered:
        found.append(_across(placed.across, over[:, 0].tolist(), low, turned=panel.turned))
    heights = (beside[:, 1] + 0.36 * NUMBER).tolist()
    numbers = (text(left - 6.0, y, each) for y, each in zip(heights, placed.up.texts, strict=True))
    found.append(element("g", {"text_anchor": "end"}, "".join(numbers)))
    middle: Attributes = {"text_anchor": "middle", "font_size": LABEL}
    if panel.across:
        down = low + below_axis(panel, placed.numbered) - 5.0
        found.append(
            text(0.5 * (left + right), down, named_axis(panel.across, placed.across.power), **middle)
        )
    if up := named_axis(panel.up, placed.up.power):
        x = left - 12.0 - placed.beside
        y = 0.5 * (top + low)
        found.append(text(x, y, up, **middle, transform=f"rotate(-90 {number(x)} {number(y)})"))
    return "".join(found)


def _across(given: Ticks, places: Sequence[float], low: float, *, turned: bool) -> str:
    """Return numbers or names below an axis."""
    if not turned:
        written = (text(x, low + NUMBER + 4.0, each) for x, each in zip(places, given.texts, strict=True))
        return element("g", {"text_anchor": "middle"}, "".join(written))
    written = (
        text(x, low + 5.0, each, transform=f"rotate(-90 {number(x)} {number(low + 5.0)})", dy=0.36 * NUMBER)
        for x, each in zip(places, given.texts, strict=True)
    )
    return element("g", {"text_anchor": "end"}, "".join(written))


def _above(placed: Placed) -> str:
    panel, (left, top, right, _) = placed.panel, placed.box
    y = top - above(panel, placed.title)
    found = []
    for line in placed.title:
        y += TITLE_LINE
        found.append(text(left, y - 3.0, line, font_size=TITLE))
    scale = (right - left) / abs(panel.limits[1, 0] - panel.limits[0, 0])
    for row, (length, colour, said) in enumerate(panel.bars):
        y, end = top - 8.0 - BAR_LINE * (len(panel.bars) - 1 - row), left + scale * length
        found.append(path(f"M{number(left)} {number(y)}H{number(end)}", stroke=colour, stroke_width=2.5))
        found.append(text(end + 5.0, y + 0.36 * LEGEND, said, font_size=LEGEND))
    return "".join(found)


def _notes(placed: Placed) -> str:
    y = placed.box[3] + below(placed.panel, placed.numbered)
    lines = (text(placed.box[0], y + NOTE_LINE * (k + 0.8), each) for k, each in enumerate(placed.notes))
    return element("g", {"font_size": NOTE}, "".join(lines)) if placed.notes else ""


def _legend(placed: Placed) -> tuple[str, list[Box]]:
    marks = labelled(placed.panel)
    if not placed.panel.legend or not marks:
        return "", []
    if placed.panel.legend == "above":
        found, x, y = [], placed.box[2], placed.box[1] - 6.0 - 0.5 * LEGEND_LINE
        for mark in reversed(marks):
            x -= SWATCH + 6.0 + width(mark.label, LEGEND) + GAP
            found.append(_entry(mark, x, y))
        return "".join(found), []
    box = legend_box(placed)
    entries = (_entry(mark, box[0], box[1] + LEGEND_LINE * (k + 0.5)) for k, mark in enumerate(marks))
    ground: Attributes = {"x": box[0], "y": box[1], "width": box[2] - box[0], "height": box[3] - box[1]}
    behind = (
        element("rect", {**ground, "fill": "white", "opacity": 0.85})
        if placed.panel.legend not in ("beside", "below")
        else ""
    )
    return behind + "".join(entries), [box]


def _entry(mark: Labelled, x: float, y: float) -> str:
    """Return a sample of a mark and its name, their middle at a height."""
    panel = Panel(np.array([[0.0, 0.0], [SWATCH, 8.0]]))
    none = Ticks(np.empty(0), [])
    own = Placed(panel, (x, y - 4.0, x + SWATCH, y + 4.0), none, none, False, [], [])
    said = text(x + SWATCH + 6.0, y + 0.36 * LEGEND, mark.label, font_size=LEGEND)
    return element("g", {"fill": "none"}, svg(sample(mark), own)) + said


def _colour_bar(shades: Shades, name: str, beside: Sequence[Placed]) -> str:
    """Return a bar of colours with numbers beside it, at the right of panels."""
    top, low = min(each.box[1] for each in beside), max(each.box[3] for each in beside)
    left = max(map(right_side, beside)) + GAP
    right = left + 9.0
    places, colours = stops(shades.map)
    steps = (
        element("stop", {"offset": place, "stop_color": hexadecimal(colour.astype(np.int64))})
        for place, colour in zip(places.tolist(), colours, strict=True)
    )
    upwards: Attributes = {"id": name, "x1": 0.0, "x2": 0.0, "y1": 1.0, "y2": 0.0}
    found = [element("linearGradient", upwards, "".join(steps))]
    ground: Attributes = {"x": left, "y": top, "width": right - left, "height": low - top}
    found.append(element("rect", {**ground, "fill": f"url(#{name})"}))
    ends = np.array([shades.low, shades.high])
    given = ticks(ends, low - top, NUMBER, across=False, log=shades.log).signed(beside[0].panel.decimal)
    heights = low - shades.parts(given.values) * (low - top)
    for y, said in zip(heights.tolist(), given.texts, strict=True):
        found.append(path(f"M{number(right)} {number(y)}h{TICK_LENGTH}", stroke=FAINT, stroke_width=0.8))
        found.append(text(right + 6.0, y + 0.36 * NUMBER, said, fill=INK))
    x, y = left + COLOUR_BAR - 8.0, 0.5 * (top + low)
    turned = f"rotate(-90 {number(x)} {number(y)})"
    look: Attributes = {"fill": INK, "font_size": LABEL, "text_anchor": "middle", "transform": turned}
    found.append(text(x, y, shades.label, **look))
    return "".join(found)
