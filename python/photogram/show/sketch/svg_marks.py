"""Marks as SVG: those of one look share an element, for thousands of points are to be no large page."""

from __future__ import annotations

import base64
import struct
import zlib
from functools import singledispatch
from html import escape
from typing import Any, TypeAlias

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import replace
from photogram.show.sketch.layout import NAME, NUMBER, Placed
from photogram.show.sketch.letters import Box, free_side, overlap, width
from photogram.show.sketch.marks import (
    Arrows,
    Contours,
    Ellipses,
    Labelled,
    Level,
    Line,
    Mark,
    Markers,
    Mesh,
    Names,
    Polygons,
    Shades,
    Texts,
    hexadecimal,
    rgb,
)

COLOURS_OF_MAP = 48
MIN_LABELLED_LENGTH = 30.0  # Points of a line on which its level is written
MIN_GAP = 4.0  # Points between levels that are written
MAX_EXACT_PLACES = 300  # Lines of more places have coordinates in tenths of a point, others in hundredths
MAX_COORDINATE = 1e5  # Points
DASHES = {"--": (3.7, 1.6), ":": (1.0, 1.65)}  # Strokes and gaps in widths of the line
# Directions of the corners of a star from the top, outer and inner in turn
STAR = np.stack([np.sin(np.pi / 5 * np.arange(10)), -np.cos(np.pi / 5 * np.arange(10))], axis=1)
# Of words over other things
HALO: dict[str, str | float] = {"stroke": "white", "stroke_linejoin": "round", "paint_order": "stroke"}
Attributes: TypeAlias = dict[str, str | float]


def element(name: str, attributes: Attributes, content: str = "") -> str:
    """Return an element; attributes that say nothing are left out."""
    said = "".join(
        f' {key.replace("_", "-")}="{escape(value) if isinstance(value, str) else number(value)}"'
        for key, value in attributes.items()
        if value != ""
    )
    return f"<{name}{said}>{content}</{name}>" if content else f"<{name}{said}/>"


def number(value: float) -> str:
    """Return a number with two decimals at most."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def text(x: float, y: float, words: str, **attributes: str | float) -> str:
    """Return words whose line begins at a place, or as `text_anchor` says."""
    return element("text", {"x": x, "y": y, **attributes}, escape(words))


def path(data: str, **attributes: str | float) -> str:
    """Return a path; nothing where it has no data."""
    return element("path", {"d": data, **attributes}) if data else ""


def joined(places: Floats, end: str = "") -> str:
    """Return a line through (n, 2) points of the picture."""
    decimals = 1 if len(places) > MAX_EXACT_PLACES else 2
    known = np.clip(places[np.isfinite(places).all(axis=1)], -MAX_COORDINATE, MAX_COORDINATE).round(decimals)
    return "M" + " ".join(f"{x:g} {y:g}" for x, y in known.tolist()) + end if len(known) > 1 else ""


def _each(places: Floats, sign: str) -> str:
    """Return the same sign from each of (n, 2) points of the picture, once where they are the same."""
    found = dict.fromkeys((round(x, 1), round(y, 1)) for x, y in places.tolist())
    return "".join(f"M{x} {y}{sign}" for x, y in found)


@singledispatch
def svg(mark: Mark, placed: Placed) -> str:
    """Return a mark on a panel."""
    raise TypeError(f"cannot draw {type(mark).__name__}")


@svg.register(Markers)
def _markers(mark: Markers, placed: Placed) -> str:
    low, high = np.sort(placed.panel.limits, axis=0)
    inside = ((mark.places >= low) & (mark.places <= high)).all(axis=1)
    at = placed.at(mark.places[inside])
    if mark.values is None or mark.shades is None:
        return _signs(mark, at, mark.colour)
    shades, values = mark.shades, mark.values[inside]
    levels = np.round((COLOURS_OF_MAP - 1) * np.clip(shades.parts(values), 0.0, 1.0))
    found = []
    for level in np.unique(levels[np.isfinite(levels)])[:: 1 if mark.rising else -1].tolist():
        colour = rgb(Shades(0.0, COLOURS_OF_MAP - 1.0, "", shades.map), np.array(level))
        found.append(_signs(mark, at[levels == level], hexadecimal(colour)))
    return "".join(found)


def _signs(mark: Markers, at: Floats, colour: str) -> str:
    size, half = mark.size, number(0.5 * mark.size)
    opacity: str | float = mark.opacity if mark.opacity < 1 else ""
    if mark.shape == "." or (mark.shape == "o" and not mark.face):
        # Half of the size and an outline: what matplotlib makes of a `.`.
        across = size if mark.shape == "o" else 0.5 * size + mark.edge
        look: Attributes = {"stroke": colour, "stroke_width": across, "stroke_linecap": "round"}
        return path(_each(at, "h0"), **look, opacity=opacity)
    if mark.shape == "+":
        data = _each(at - [0.5 * size, 0.0], f"h{number(size)}m-{half}-{half}v{number(size)}")
        return path(data, stroke=colour, stroke_width=mark.edge, opacity=opacity)
    diagonal = number(np.sqrt(0.5) * size)
    star = np.tile([0.5 * size, 0.19 * size], 5)[:, np.newaxis] * STAR
    corners = "".join(f"l{x:.2f} {y:.2f}" for x, y in np.diff(star, axis=0).tolist())
    shift, sign = {
        "*": (star[0], f"{corners}z"),
        "o": (
            [-0.5 * size, 0.0],
            f"a{half} {half} 0 1 0 {number(size)} 0a{half} {half} 0 1 0 -{number(size)} 0z",
        ),
        "^": ([0.0, -0.5 * size], f"l{half} {number(size)}h-{number(size)}z"),
        "s": ([-0.5 * size, -0.5 * size], f"h{number(size)}v{number(size)}h-{number(size)}z"),
        "D": (
            [0.0, -np.sqrt(0.5) * size],
            f"l{diagonal} {diagonal}l-{diagonal} {diagonal}l-{diagonal}-{diagonal}z",
        ),
    }[mark.shape]
    look = {"fill": mark.face or colour, "stroke": colour, "stroke_width": mark.edge, "opacity": opacity}
    return path(_each(at + shift, sign), **look)


def _stroke(colour: str, wide: float, dash: str = "") -> Attributes:
    dashes = " ".join(number(wide * each) for each in DASHES[dash]) if dash else ""
    return {"stroke": colour, "stroke_width": wide, "stroke_dasharray": dashes}


@svg.register(Line)
def _line(mark: Line, placed: Placed) -> str:
    opacity: str | float = mark.opacity if mark.opacity < 1 else ""
    look = _stroke(mark.colour, mark.width, mark.dash)
    if mark.places.ndim > 2:
        return path("".join(map(joined, placed.at(mark.places))), **look, opacity=opacity)
    return path(joined(placed.at(mark.places)), **look, opacity=opacity, stroke_linejoin="round")


@svg.register(Level)
def _level(mark: Level, placed: Placed) -> str:
    height = placed.at(np.array([placed.panel.limits[0, 0], mark.height]))[1]
    data = f"M{number(placed.box[0])} {number(height)}H{number(placed.box[2])}"
    return path(data, **_stroke(mark.colour, mark.width, mark.dash))


@svg.register(Arrows)
def _arrows(mark: Arrows, placed: Placed) -> str:
    thick = mark.width * (placed.box[2] - placed.box[0])
    tails, ends = placed.at(mark.places), placed.at(mark.places + mark.vectors)
    lengths = np.hypot(*(ends - tails).T)
    with np.errstate(invalid="ignore"):
        along = (ends - tails) / lengths[:, np.newaxis]
    # Heads of short arrows are as small as these.
    head = np.minimum(4.5 * thick, lengths)
    necks = ends - head[:, np.newaxis] * along
    aside = (head * 1.75 / 4.5)[:, np.newaxis] * np.column_stack([-along[:, 1], along[:, 0]])
    outlines = np.stack([ends, necks + aside, necks - aside], axis=1)
    long = lengths > 4.5 * thick
    found = []
    colours = np.array([mark.colours] * len(lengths) if isinstance(mark.colours, str) else mark.colours)
    for colour in dict.fromkeys(colours.tolist()):
        own = (colours == colour) & (lengths > 0)
        shafts = "".join(joined(each) for each in np.stack([tails, necks], axis=1)[own & long])
        heads = "".join(joined(each, "z") for each in outlines[own])
        found += [path(shafts, stroke=colour, stroke_width=thick), path(heads, fill=colour)]
    return "".join(found)


@svg.register(Polygons)
def _polygons(mark: Polygons, placed: Placed) -> str:
    outlines = [joined(each, "z") for each in placed.at(mark.places)]
    if not mark.edge:
        return path("".join(outlines), fill=mark.face, opacity=mark.face_opacity)
    look: Attributes = {
        "fill": mark.face,
        "fill_opacity": f"{mark.face_opacity:.3g}",
        "stroke": mark.edge,
        "stroke_opacity": mark.edge_opacity,
        "stroke_width": mark.width,
    }
    # Each by itself: where many lie over each other, it is darker.
    return element("g", look, "".join(map(path, outlines)))


@svg.register(Ellipses)
def _ellipses(mark: Ellipses, placed: Placed) -> str:
    turn = np.radians(mark.angles)[:, np.newaxis]
    along, across = (
        semi[:, np.newaxis] * np.column_stack(ways)
        for semi, ways in zip(
            mark.semi_axes.T, ((np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))), strict=True
        )
    )
    middle = placed.at(mark.places)
    along, across = placed.at(mark.places + along) - middle, placed.at(mark.places + across) - middle
    turned = np.degrees(np.arctan2(along[:, 1], along[:, 0]))
    rows = np.column_stack([middle + along, np.hypot(*along.T), np.hypot(*across.T), turned, -2 * along])
    data = "".join(
        f"M{x:.2f} {y:.2f}a{a:.2f} {b:.2f} {angle:.1f} 1 0 {u:.2f} {v:.2f}"
        f"a{a:.2f} {b:.2f} {angle:.1f} 1 0 {-u:.2f} {-v:.2f}z"
        for x, y, a, b, angle, u, v in rows.tolist()
    )
    if mark.fill:
        return path(data, fill=mark.colour, opacity=mark.fill)
    return path(data, **_stroke(mark.colour, mark.width))


@svg.register(Mesh)
def _mesh(mark: Mesh, placed: Placed) -> str:
    (x, y), (to_x, to_y) = placed.at(mark.corners).tolist()
    values = mark.values[:: 1 if y < to_y else -1, :: 1 if x < to_x else -1]
    there = np.isfinite(values)
    colours = rgb(mark.shades, np.where(there, values, mark.shades.low))
    content = _png(np.concatenate([colours, 255 * there[:, :, np.newaxis]], axis=2))
    place: Attributes = {
        "x": min(x, to_x),
        "y": min(y, to_y),
        "width": abs(to_x - x),
        "height": abs(to_y - y),
    }
    look: Attributes = {"preserveAspectRatio": "none", "style": "image-rendering:pixelated"}
    address = f"data:image/png;base64,{base64.b64encode(content).decode()}"
    return element("image", {**place, **look, "href": address})


def _png(pixels: Indices) -> bytes:
    """Return (rows, columns, 4) red, green, blue and opacity, 0 to 255, as a PNG file."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows, columns, _ = pixels.shape
    lines = b"".join(b"\0" + row.tobytes() for row in pixels.astype(np.uint8))
    head = struct.pack(">IIBBBBB", columns, rows, 8, 6, 0, 0, 0)
    parts = chunk(b"IHDR", head), chunk(b"IDAT", zlib.compress(lines)), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


@svg.register(Texts)
def _texts(mark: Texts, placed: Placed) -> str:
    words = zip(placed.at(mark.places).tolist(), mark.texts, mark.colours, strict=True)
    found = (text(x, y + 0.36 * mark.size, said, fill=colour) for (x, y), said, colour in words)
    return element("g", {"font_size": mark.size, "text_anchor": mark.anchor}, "".join(found))


@svg.register(Names)
def _later(mark: Names, placed: Placed) -> str:
    """Return nothing: names come last, and are not cut at the sides of the panel."""
    return ""


def names(placed: Placed, taken: list[Box]) -> str:
    """Return the names on a panel, which keep clear of each other and of boxes that are taken."""
    found = []
    left, top, right, low = placed.box
    # As if upwards: names are tried above their places first.
    taken = [(box[0], -box[3], box[2], -box[1]) for box in taken]
    for mark in placed.panel.marks:
        if not isinstance(mark, Names):
            continue
        at, avoid = (placed.at(each) * [1.0, -1.0] for each in (mark.places, mark.avoid))
        obstacles, room = np.concatenate([at, avoid]), (left, -low, right, -top)
        for place, said, colour in zip(at.tolist(), mark.texts, mark.colours, strict=True):
            size = (width(said, NAME) + 0.8, NAME + 1.0)
            box = free_side(size, (place[0], place[1]), 4.0, taken, obstacles, room)
            if box is not None:
                taken.append(box)
                found.append(text(box[0] + 0.4, -box[1] - 1.8, said, fill=colour))
    return element("g", {"font_size": NAME, "stroke_width": 1.6, **HALO}, "".join(found)) if found else ""


def sample(mark: Labelled) -> Labelled:
    """Return what a legend shows of a mark, on a panel of 16 by 8 points."""
    line = np.array([[0.0, 4.0], [16.0, 4.0]])
    if isinstance(mark, Markers):
        return replace(mark, places=np.array([[8.0, 4.0]]), size=max(mark.size, 4.0), values=None)
    if isinstance(mark, Line):
        return replace(mark, places=line if mark.places.ndim == 2 else line[np.newaxis])
    if isinstance(mark, Arrows):
        return replace(mark, places=line[:1], vectors=line[1:] - line[:1], width=1.3 / 16.0)
    assert isinstance(mark, Polygons)
    return replace(mark, places=np.array([[[0.0, 1.0], [16.0, 1.0], [16.0, 7.0], [0.0, 7.0]]]))


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
