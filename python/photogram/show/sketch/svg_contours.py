"""Contours as SVG: areas from the lowest level up over each other, lines, and levels where there is room."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.show.sketch.layout import NUMBER, Placed
from photogram.show.sketch.letters import Box, overlap, width
from photogram.show.sketch.marks import Contours, Shades, hexadecimal, rgb
from photogram.show.sketch.svg_marks import HALO, element, joined, path, svg, text

MIN_LABELLED_LENGTH = 30.0  # Points of a line on which its level is written
MIN_GAP = 4.0  # Points between levels that are written


def _generator(mark: Contours) -> Any:
    try:
        from contourpy import FillType, LineType, contour_generator  # of matplotlib, loaded in a moment
    except ModuleNotFoundError:
        message = "contours need contourpy: pip install 'photogram[report]'"
        raise ModuleNotFoundError(message, name="contourpy") from None

    return contour_generator(
        mark.across,
        mark.up,
        np.ma.masked_invalid(mark.values),
        fill_type=FillType.OuterOffset,
        line_type=LineType.Separate,
    )


@svg.register(Contours)
def _contours(mark: Contours, placed: Placed) -> str:
    made, bounds, found = _generator(mark), mark.bounds, []
    below, beyond = np.nanmin(mark.values) - 1.0, max(np.nanmax(mark.values), bounds[-1]) + 1.0
    middles = mark.shades.parts(bounds[:-1]) / 2 + mark.shades.parts(bounds[1:]) / 2
    colours = rgb(Shades(0.0, 1.0, "", mark.shades.map), middles)
    # What is below the first has its colour, too; no seams, for each lies over those before.
    for low, colour in zip([below, *bounds[1:-1].tolist()], colours, strict=True):
        rings = [
            placed.at(ring)
            for outlines, ends in zip(*made.filled(low, beyond), strict=True)
            for ring in np.split(outlines, ends[1:-1])
        ]
        data = "".join(joined(ring, "z") for ring in rings)
        found.append(path(data, fill=hexadecimal(colour), fill_rule="evenodd"))
    lines = (joined(placed.at(line)) for level in mark.levels.tolist() for line in made.lines(level))
    return "".join(found) + path("".join(lines), stroke=mark.colour, stroke_width=mark.width)


def levels_written(placed: Placed, taken: list[Box]) -> str:
    """Return the levels of contours on their lines; the room that they take is added to what is taken."""
    found = []
    for mark in placed.panel.marks:
        if not isinstance(mark, Contours):
            continue
        made = _generator(mark)
        for level in mark.levels.tolist():
            said = f"{level:g}".replace("-", "−")
            for line in made.lines(level):
                if (box := _free(placed.at(line), width(said, NUMBER), placed.box, taken)) is not None:
                    taken.append(box)
                    found.append(text(0.5 * (box[0] + box[2]), box[3] - 0.14 * NUMBER, said))
    look = {"font_size": NUMBER, "text_anchor": "middle", "stroke_width": 2.0, **HALO}
    return element("g", look, "".join(found)) if found else ""


def _free(line: Floats, wide: float, room: Box, taken: list[Box]) -> Box | None:
    """Return a box in the middle of a line, or nearer to its ends, that is within the room and free."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    if lengths[-1] < MIN_LABELLED_LENGTH:
        return None
    for part in (0.5, 0.3, 0.7, 0.15, 0.85):
        x, y = (float(np.interp(part * lengths[-1], lengths, own)) for own in line.T)
        box = x - 0.5 * wide, y - 0.5 * NUMBER, x + 0.5 * wide, y + 0.5 * NUMBER
        around = box[0] - MIN_GAP, box[1] - MIN_GAP, box[2] + MIN_GAP, box[3] + MIN_GAP
        inside = room[0] < box[0] and box[2] < room[2] and room[1] < box[1] and box[3] < room[3]
        if inside and not any(overlap(around, other) for other in taken):
            return box
    return None
