"""Marks as SVG; marks with the same style share an element to limit the file size."""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Sequence
from html import escape
from typing import TypeAlias

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import replace
from photogram.show.sketch import marks
from photogram.show.sketch.layout import NAME, Placed
from photogram.show.sketch.letters import Box, free_names
from photogram.show.sketch.marks import Labelled, hexadecimal, rgb

Attributes: TypeAlias = dict[str, str | float]
COLOURS_OF_MAP = 48
MAX_EXACT_PLACES = 300  # Longer lines have coordinates in tenths of a point, others in hundredths
MAX_COORDINATE = 1e4  # Points
DASHES = {"--": (3.7, 1.6), ":": (1.0, 1.65)}  # Dashes and gaps in line widths
_POINTS = np.pi / 5 * np.arange(10)
# Corners of symbols in half sizes; a star has outer and inner corners in turn.
CORNERS = {
    "^": np.array([[0.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
    "s": np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
    "D": np.sqrt(2.0) * np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]),
    "*": np.resize([1.0, 0.38], (10, 1)) * np.stack([np.sin(_POINTS), -np.cos(_POINTS)], axis=1),
}


def element(name: str, content: str = "", /, **attributes: str | float) -> str:
    """Return an element without empty attributes and full opacities."""
    written = "".join(
        f' {key.replace("_", "-")}="{escape(value) if isinstance(value, str) else number(value)}"'
        for key, value in attributes.items()
        if value != "" and not (value == 1.0 and "opacity" in key)
    )
    return f"<{name}{written}>{content}</{name}>" if content else f"<{name}{written}/>"


def number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def text(x: float, y: float, words: str, turned: bool = False, **attributes: str | float) -> str:
    """Return text that begins at a point, or as in `text_anchor`; upwards if `turned`."""
    rotation = f"rotate(-90 {number(x)} {number(y)})" if turned else ""
    return element("text", escape(words), x=x, y=y, **attributes, transform=rotation)


def path(data: str, **attributes: str | float) -> str:
    """Return a path; empty without data."""
    return element("path", d=data, **attributes) if data else ""


def place(left: float, top: float, right: float, low: float) -> Attributes:
    return {"x": left, "y": top, "width": right - left, "height": low - top}


def joined(lines: Sequence[Floats] | Floats, placed: Placed | None = None, end: str = "") -> list[str]:
    """Return every line through (n, 2) points of a panel, or of the plot."""
    if not len(lines):
        return []
    places = np.concatenate(lines)
    places = np.clip(placed.at(places) if placed else places, -MAX_COORDINATE, MAX_COORDINATE)
    exact, first, found = places.round(2).tolist(), 0, []
    for count in map(len, lines):
        last = first + count
        own = exact[first:last] if count <= MAX_EXACT_PLACES else places[first:last].round(1).tolist()
        known = [f"{x:g} {y:g}" for x, y in own if x == x and y == y]  # without NaN
        found.append(f"M{' '.join(known)}{end}" if len(known) > 1 else "")
        first = last
    return found


def _each(places: Floats, sign: str) -> str:
    """Return the same symbol at each of (n, 2) points, without duplicates."""
    found = dict.fromkeys(map(tuple, places.round(1).tolist()))
    return "".join([f"M{x} {y}{sign}" for x, y in found])


def svg(mark: marks.Mark, placed: Placed) -> str:
    """Return a mark on a panel; `Names` are last, and not clipped."""
    match mark:
        case marks.Markers():
            return _markers(mark, placed)
        case marks.Line():
            data = "".join(joined(mark.lines, placed))
            join = "round" if any(len(line) > 2 for line in mark.lines) else ""
            return path(data, **_stroke(mark, mark.dash), opacity=mark.opacity, stroke_linejoin=join)
        case marks.Arrows():
            return _arrows(mark, placed)
        case marks.Polygons():
            return _polygons(mark, placed)
        case marks.Ellipses():
            return _ellipses(mark, placed)
        case marks.Mesh():
            return _mesh(mark, placed)
        case marks.Texts():
            rows = zip(placed.at(mark.places).tolist(), mark.texts, mark.colours, strict=True)
            found = [text(x, y + 0.36 * mark.size, words, fill=colour) for (x, y), words, colour in rows]
            return element("g", "".join(found), font_size=mark.size, text_anchor=mark.anchor)
        case marks.Names():
            return ""
    raise TypeError(f"the renderer for SVG does not draw {type(mark).__name__}")


def _markers(mark: marks.Markers, placed: Placed) -> str:
    low, high = np.sort(placed.panel.limits, axis=0)
    inside = ((mark.places >= low) & (mark.places <= high)).all(axis=1)
    at = placed.at(mark.places[inside])
    if mark.values is None or mark.shades is None:
        return _signs(mark, at, mark.colour)
    shades, values = mark.shades, mark.values[inside]
    levels = np.round((COLOURS_OF_MAP - 1) * np.clip(shades.parts(values), 0.0, 1.0))
    found = []
    for level in np.unique(levels[np.isfinite(levels)])[:: 1 if mark.rising else -1]:
        colour = hexadecimal(rgb(shades, shades.values(level / (COLOURS_OF_MAP - 1))))
        found.append(_signs(mark, at[levels == level], colour))
    return "".join(found)


def _signs(mark: marks.Markers, at: Floats, colour: str) -> str:
    size, half = number(mark.size), number(0.5 * mark.size)
    look: Attributes = {"stroke": colour, "stroke_width": mark.edge, "opacity": mark.opacity}
    if mark.shape == "." or (mark.shape == "o" and not mark.face):
        # Half the size plus an outline, as for `.` in matplotlib.
        look["stroke_width"] = mark.size if mark.shape == "o" else 0.5 * mark.size + mark.edge
        return path(_each(at, "h0"), **look, stroke_linecap="round")
    start = np.array([-0.5 * mark.size, 0.0])
    if mark.shape == "+":
        return path(_each(at + start, f"h{size}m-{half}-{half}v{size}"), **look)
    if mark.shape == "o":
        sign = f"a{half} {half} 0 1 0 {size} 0a{half} {half} 0 1 0 -{size} 0z"
    else:
        start, *_ = corners = 0.5 * mark.size * CORNERS[mark.shape]
        steps = np.diff(corners, axis=0).tolist()
        sign = "".join(f"l{number(x)} {number(y)}" for x, y in steps) + "z"
    return path(_each(at + start, sign), fill=mark.face or colour, **look)


def _stroke(mark: marks.Line | marks.Ellipses, dash: str = "") -> Attributes:
    dashes = " ".join(number(mark.width * each) for each in DASHES.get(dash, ()))
    return {"stroke": mark.colour, "stroke_width": mark.width, "stroke_dasharray": dashes}


def _arrows(mark: marks.Arrows, placed: Placed) -> str:
    thick = mark.width * (placed.box[2] - placed.box[0])
    tails, ends = placed.at(mark.places), placed.at(mark.places + mark.vectors)
    lengths = np.hypot(*(ends - tails).T)
    with np.errstate(invalid="ignore"):
        along = (ends - tails) / lengths[:, np.newaxis]
    # Heads of short arrows are not longer than the arrow.
    head = np.minimum(4.5 * thick, lengths)
    necks = ends - head[:, np.newaxis] * along
    aside = (head * 1.75 / 4.5)[:, np.newaxis] * np.column_stack([-along[:, 1], along[:, 0]])
    outlines = np.stack([ends, necks + aside, necks - aside], axis=1)
    long = lengths > 4.5 * thick
    found, colours = [], np.broadcast_to(mark.colours, len(lengths))
    for colour in dict.fromkeys(colours.tolist()):
        own = (colours == colour) & (lengths > 0)
        shafts = "".join(joined(np.stack([tails, necks], axis=1)[own & long]))
        heads = "".join(joined(outlines[own], end="z"))
        found += [path(shafts, stroke=colour, stroke_width=thick), path(heads, fill=colour)]
    return "".join(found)


def _polygons(mark: marks.Polygons, placed: Placed) -> str:
    outlines = joined(mark.places, placed, "z")
    if not mark.edge:
        return path("".join(outlines), fill=mark.face, opacity=mark.face_opacity)
    inside: Attributes = {"fill": mark.face, "fill_opacity": f"{mark.face_opacity:.3g}"}
    edge: Attributes = {"stroke": mark.edge, "stroke_opacity": mark.edge_opacity, "stroke_width": mark.width}
    # Separate outlines, so that overlapping areas are darker.
    return element("g", "".join(map(path, outlines)), **inside, **edge)


def _ellipses(mark: marks.Ellipses, placed: Placed) -> str:
    turn, middle = np.radians(mark.angles)[:, np.newaxis], placed.at(mark.places)
    along, across = (
        placed.at(mark.places + semi[:, np.newaxis] * np.hstack([np.cos(angle), np.sin(angle)])) - middle
        for semi, angle in zip(mark.semi_axes.T, (turn, turn + np.pi / 2), strict=True)
    )
    turned = np.degrees(np.arctan2(along[:, 1], along[:, 0]))
    rows = np.column_stack([middle + along, np.hypot(*along.T), np.hypot(*across.T), turned, -2 * along])
    data = "".join(
        f"M{x:.2f} {y:.2f}a{a:.2f} {b:.2f} {angle:.1f} 1 0 {u:.2f} {v:.2f}"
        f"a{a:.2f} {b:.2f} {angle:.1f} 1 0 {-u:.2f} {-v:.2f}z"
        for x, y, a, b, angle, u, v in rows.tolist()
    )
    return path(data, fill=mark.colour, opacity=mark.fill) if mark.fill else path(data, **_stroke(mark))


def _mesh(mark: marks.Mesh, placed: Placed) -> str:
    (x, y), (to_x, to_y) = placed.at(mark.corners).tolist()
    values = mark.values[:: 1 if y < to_y else -1, :: 1 if x < to_x else -1]
    there = np.isfinite(values)
    colours = rgb(mark.shades, np.where(there, values, mark.shades.low))
    content = _png(np.concatenate([colours, 255 * there[:, :, np.newaxis]], axis=2))
    return element(
        "image",
        **place(min(x, to_x), min(y, to_y), max(x, to_x), max(y, to_y)),
        preserveAspectRatio="none",
        style="image-rendering:pixelated",
        href=f"data:image/png;base64,{base64.b64encode(content).decode()}",
    )


def _png(pixels: Indices) -> bytes:
    """Return (rows, columns, 4) red, green, blue and opacity, 0 to 255, as a PNG file."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows, columns, _ = pixels.shape
    lines = b"".join(b"\0" + row.tobytes() for row in pixels.astype(np.uint8))
    head = struct.pack(">IIBBBBB", columns, rows, 8, 6, 0, 0, 0)
    parts = chunk(b"IHDR", head), chunk(b"IDAT", zlib.compress(lines)), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def names(placed: Placed, taken: list[Box]) -> str:
    """Return the names on a panel, without overlaps with boxes `taken`."""
    left, top, right, low = placed.box
    # With y upwards, so that positions above the points are tried first.
    found, taken = [], [(box[0], -box[3], box[2], -box[1]) for box in taken]
    for mark in placed.panel.marks:
        if isinstance(mark, marks.Names):
            at, avoid = (placed.at(each) * [1.0, -1.0] for each in (mark.places, mark.avoid))
            for row, box in free_names(
                mark.texts, at, avoid, NAME, (left, -low, right, -top), taken, mark.centred
            ):
                found.append(text(box[0] + 0.4, -box[1] - 1.8, mark.texts[row], fill=mark.colours[row]))
    halo: Attributes = {"stroke": "white", "stroke_linejoin": "round", "paint_order": "stroke"}
    return element("g", "".join(found), font_size=NAME, stroke_width=1.6, **halo) if found else ""


def sample(mark: Labelled) -> Labelled:
    """Return the sample of a mark for a legend, on a panel of 16 by 8 points."""
    line = np.array([[0.0, 4.0], [16.0, 4.0]])
    if isinstance(mark, marks.Markers):
        return replace(mark, places=np.array([[8.0, 4.0]]), size=max(mark.size, 4.0), values=None)
    if isinstance(mark, marks.Line):
        return replace(mark, places=line)
    if isinstance(mark, marks.Arrows):
        return replace(mark, places=line[:1], vectors=line[1:] - line[:1], width=1.3 / 16.0)
    assert isinstance(mark, marks.Polygons)
    return replace(mark, places=np.array([[[0.0, 1.0], [16.0, 1.0], [16.0, 7.0], [0.0, 7.0]]]))
