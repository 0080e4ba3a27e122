"""Plots written directly as SVG, which is faster than matplotlib.

Marks with the same style share an element to limit the file size.
"""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Sequence
from html import escape
from typing import TypeAlias

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.show.sketch import marks
from photogram.show.sketch.layout import NAME, NUMBER, POINTS, Placed, free_names, laid_out
from photogram.show.sketch.marks import NOWHERE, Sketch, hexadecimal, rgb
from photogram.show.style import SETTINGS

Attributes: TypeAlias = dict[str, str | float]
LETTERS = ", ".join([*SETTINGS["font.sans-serif"], "sans-serif"])
COLOURS_OF_MAP = 48
MAX_COORDINATE = 1e4  # Points
DASHES = {"": (), "--": (3.7, 1.6), ":": (1.0, 1.65)}  # Dashes and gaps in line widths
_POINTS = np.pi / 5 * np.arange(10)
# Corners of symbols in half sizes; a star has outer and inner corners in turn.
CORNERS = {
    "^": np.array([[0.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
    "s": np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
    "D": np.sqrt(2.0) * np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]),
    "*": np.resize([1.0, 0.38], (10, 1)) * np.stack([np.sin(_POINTS), -np.cos(_POINTS)], axis=1),
}


def svg_of(sketch: Sketch, name: str, title: str) -> str:
    """Return a plot as an SVG element; empty without panels.

    Identifiers of its parts begin with `name`; `title` is its text alternative.
    """
    panels = laid_out(sketch)
    if not panels:
        return ""
    parts = []
    for k, placed in enumerate(panels):
        clip = element("clipPath", element("rect", **_place(placed.box)), id=f"{name}-{k}-clip")
        inside = "".join(
            svg(mark, placed) for mark in sorted(placed.panel.marks, key=lambda each: each.layer)
        )
        clipped = element("g", inside, clip_path=f"url(#{name}-{k}-clip)") if inside else ""
        parts += [clip, clipped, *(svg(mark, POINTS) for mark in placed.frame), _names(placed)]
    right, low = np.max([placed.ends for placed in panels], axis=0).tolist()
    content = element("g", "".join(parts), font_family=LETTERS, font_size=NUMBER, fill="none")
    size = f'viewBox="0 0 {right + 2:.0f} {low + 2:.0f}" width="{96 / 72 * (right + 2):.0f}"'
    head = element("svg", role="img", aria_label=title).removesuffix("/>")
    return f'{head} xmlns="http://www.w3.org/2000/svg" {size}>{content}</svg>'


def element(name: str, content: str | None = None, /, **attributes: str | float) -> str:
    """Return an element without empty attributes and full opacities; its content is SVG or HTML."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(value) if isinstance(value, str) else number(value)}"'
        for key, value in attributes.items()
        if value != "" and not (value == 1.0 and "opacity" in key)
    )
    return f"<{name}{written}/>" if content is None else f"<{name}{written}>{content}</{name}>"


def number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _path(data: str, **attributes: str | float) -> str:
    """Return a path; empty without data."""
    return element("path", d=data, **attributes) if data else ""


def _place(box: tuple[float, float, float, float]) -> Attributes:
    left, top, right, low = box
    return {"x": left, "y": top, "width": right - left, "height": low - top}


def _joined(lines: Sequence[Floats] | Floats, placed: Placed = POINTS, end: str = "") -> list[str]:
    """Return every line through (n, 2) points of a panel, in steps of tenths of a point."""
    line = np.repeat(np.arange(len(lines)), [len(each) for each in lines])
    places = placed.at(np.concatenate([NOWHERE, *lines]))
    known = ~np.isnan(places).any(axis=1)
    tenths = np.rint(10.0 * np.clip(places[known], -MAX_COORDINATE, MAX_COORDINATE))
    starts = (tenths / 10.0 + 0.0).tolist()
    steps = (np.diff(tenths, axis=0, prepend=0.0) / 10.0 + 0.0).tolist()  # Without negative zeros
    found, first = [], 0
    for count in np.bincount(line[known], minlength=len(lines)).tolist():
        if count > 1:
            x, y = starts[first]
            path = " ".join([f"{x:g} {y:g}" for x, y in steps[first + 1 : first + count]])
            found.append(f"M{x:g} {y:g}l{path.replace(' -', '-')}{end}")
        first += count
    return found


def svg(mark: marks.Mark, placed: Placed) -> str:
    """Return a mark on a panel; `Names` are last, and not clipped."""
    match mark:
        case marks.Markers():
            return _markers(mark, placed)
        case marks.Line():
            look: Attributes = {"stroke": mark.colour, "stroke_width": mark.width, "opacity": mark.opacity}
            look["stroke_dasharray"] = " ".join(number(mark.width * part) for part in DASHES[mark.dash])
            look["stroke_linejoin"] = "round" if any(len(line) > 2 for line in mark.lines) else ""
            return _path("".join(_joined(mark.lines, placed)), **look)
        case marks.Arrows():
            return _arrows(mark, placed)
        case marks.Polygons():
            outlines = _joined(mark.places, placed, "z")
            if not mark.edge:
                return _path("".join(outlines), fill=mark.face, opacity=mark.face_opacity)
            inside: Attributes = {"fill": mark.face, "fill_opacity": f"{mark.face_opacity:.3g}"}
            edge: Attributes = {"stroke": mark.edge, "stroke_opacity": mark.edge_opacity}
            # Separate outlines, so that overlapping areas are darker.
            return element("g", "".join(map(_path, outlines)), **inside, **edge, stroke_width=mark.width)
        case marks.Ellipses():
            return _ellipses(mark, placed)
        case marks.Mesh():
            return _mesh(mark, placed)
        case marks.Texts():
            return _texts(mark, placed)
        case marks.Names():
            return ""
    raise TypeError(f"the renderer for SVG does not draw {type(mark).__name__}")


def _markers(mark: marks.Markers, placed: Placed) -> str:
    low, high = np.sort(placed.panel.limits, axis=0)
    inside = ((mark.places >= low) & (mark.places <= high)).all(axis=1)
    at, shades = placed.at(mark.places[inside]), mark.shades
    groups = [(mark.colour, at)]
    if mark.values is not None and shades is not None:
        levels = np.round((COLOURS_OF_MAP - 1) * np.clip(shades.parts(mark.values[inside]), 0.0, 1.0))
        order = np.unique(levels[np.isfinite(levels)])[:: 1 if mark.rising else -1]
        colours = rgb(shades, shades.values(order / (COLOURS_OF_MAP - 1)))
        groups = [(hexadecimal(own), at[levels == level]) for own, level in zip(colours, order, strict=True)]
    size, half, start = number(mark.size), number(0.5 * mark.size), np.array([-0.5 * mark.size, 0.0])
    look: Attributes = {"stroke_width": mark.edge, "opacity": mark.opacity}
    if mark.shape == "." or (mark.shape == "o" and not mark.face):
        # Half the size plus an outline, as for `.` in matplotlib.
        look["stroke_width"] = mark.size if mark.shape == "o" else 0.5 * mark.size + mark.edge
        start, sign, look["stroke_linecap"] = np.zeros(2), "h0", "round"
    elif mark.shape == "+":
        sign = f"h{size}m-{half}-{half}v{size}"
    elif mark.shape == "o":
        sign = f"a{half} {half} 0 1 0 {size} 0a{half} {half} 0 1 0 -{size} 0z"
    else:
        start, *_ = corners = 0.5 * mark.size * CORNERS[mark.shape]
        sign = "".join(f"l{number(x)} {number(y)}" for x, y in np.diff(corners, axis=0).tolist()) + "z"
    found = []
    for colour, own in groups:
        places = dict.fromkeys(map(tuple, (own + start).round(1).tolist()))  # Without duplicates
        # Typst omits paths without extent.
        own_sign = "h.01" if sign == "h0" and len(places) == 1 else sign
        data = "".join([f"M{x} {y}{own_sign}" for x, y in places])
        fill = (mark.face or colour) if sign.endswith("z") else ""
        found.append(_path(data, stroke=colour, fill=fill, **look))
    return "".join(found)


def _arrows(mark: marks.Arrows, placed: Placed) -> str:
    thick = mark.width * (placed.box[2] - placed.box[0])
    tails = placed.at(mark.places)
    steps = placed.at(mark.places + mark.vectors) - tails
    lengths = np.hypot(*steps.T)
    with np.errstate(invalid="ignore"):
        along = steps / lengths[:, np.newaxis]
    # Heads of short arrows are not longer than the arrow.
    head = np.minimum(4.5 * thick, lengths)[:, np.newaxis]
    necks, aside = tails + steps - head * along, 1.75 / 4.5 * head * along[:, ::-1] * [-1.0, 1.0]
    outlines = np.stack([tails + steps, necks + aside, necks - aside], axis=1)
    colours, long = np.broadcast_to(mark.colours, len(lengths)), lengths > 4.5 * thick
    found = []
    for colour in dict.fromkeys(colours.tolist()):
        own = (colours == colour) & (lengths > 0)
        shafts = "".join(_joined(np.stack([tails, necks], axis=1)[own & long]))
        heads = "".join(_joined(outlines[own], end="z"))
        found += [_path(shafts, stroke=colour, stroke_width=thick), _path(heads, fill=colour)]
    return "".join(found)


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
    if mark.fill:
        return _path(data, fill=mark.colour, opacity=mark.fill)
    return _path(data, stroke=mark.colour, stroke_width=mark.width)


def _mesh(mark: marks.Mesh, placed: Placed) -> str:
    (x, y), (to_x, to_y) = placed.at(mark.corners).tolist()
    values = mark.values[:: 1 if y < to_y else -1, :: 1 if x < to_x else -1]
    there = np.isfinite(values)
    colours = rgb(mark.shades, np.where(there, values, mark.shades.low))
    content = _png(np.concatenate([colours, 255 * there[:, :, np.newaxis]], axis=2))
    return element(
        "image",
        **_place((min(x, to_x), min(y, to_y), max(x, to_x), max(y, to_y))),
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


def _texts(mark: marks.Texts, placed: Placed, **look: str | float) -> str:
    found, colours = [], np.broadcast_to(mark.colours, len(mark.texts)).tolist()
    one = colours[0] if len(set(colours)) == 1 else ""
    for (x, y), words, colour in zip(placed.at(mark.places).tolist(), mark.texts, colours, strict=True):
        # Baselines are below the middle of letters.
        x, y = (x + 0.36 * mark.size, y) if mark.turned else (x, y + 0.36 * mark.size)
        rotation = f"rotate(-90 {number(x)} {number(y)})" if mark.turned else ""
        fill = "" if one else colour
        found.append(element("text", escape(words), x=x, y=y, fill=fill, transform=rotation))
    look |= {"font_size": mark.size, "text_anchor": mark.anchor.removeprefix("start")}
    return element("g", "".join(found), fill=one, **look) if found else ""


def _names(placed: Placed) -> str:
    left, top, right, low = placed.box
    # With y upwards, so that positions above the points are tried first.
    found, taken = list[str](), list[tuple[float, float, float, float]]()
    for mark in placed.panel.marks:
        if isinstance(mark, marks.Names):
            at, avoid = (placed.at(each) * [1.0, -1.0] for each in (mark.places, mark.avoid))
            free = [*free_names(mark, at, avoid, NAME, (left, -low, right, -top), taken)]
            places = np.reshape([(box[0] + 0.4, -box[1] - 1.8 - 0.36 * NAME) for _, box in free], (-1, 2))
            texts, colours = ([words[row] for row, _ in free] for words in (mark.texts, mark.colours))
            halo: Attributes = {"stroke": "white", "stroke_linejoin": "round", "paint_order": "stroke"}
            names = marks.Texts(places, texts, NAME, colours)
            found.append(_texts(names, POINTS, stroke_width=1.6, **halo))
    return "".join(found)
