"""Elements of panels in units of axes, sizes in points (1/72 inch)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.extras import need
from photogram.lazy_dataclasses import dataclass, field
from photogram.show.style import BLUE, INK, VERMILION

NOWHERE = np.empty((0, 2))


@dataclass(frozen=True, eq=False, kw_only=True)
class Mark:
    """An element of a panel; marks of a higher `layer` cover others."""

    layer: float = 2.0
    label: str = ""  # In the legend: of markers, lines, arrows and polygons


@dataclass(frozen=True, eq=False)
class Shades:
    """Colours of `ordered` or `signed` values from `low` to `high`, with `label`.

    If `log`, equal ratios of values have equal steps of colour.
    """

    low: float
    high: float
    label: str
    map: str = "ordered"
    log: bool = False

    def parts(self, values: Floats) -> Floats:
        """Return relative positions of values, 0 and 1 at the ends."""
        low, high, own = (np.log(x) if self.log else x for x in (self.low, self.high, values))
        return np.asarray((own - low) / (high - low))

    def values(self, parts: Floats) -> Floats:
        if self.log:
            return np.asarray(self.low * (self.high / self.low) ** parts)
        return self.low + (self.high - self.low) * parts


@dataclass(frozen=True, eq=False)
class Markers(Mark):
    """Small symbols at (n, 2) points."""

    places: Floats
    shape: str  # As in matplotlib: `.`, `o`, `+`, `^`, `s`, `D`, `*`, and the markersize
    size: float
    colour: str = INK
    face: str = ""  # Fill colour; default: the colour of the outline
    edge: float = 1.0  # Width of the outline
    opacity: float = 1.0
    # (n,) values that define the colours, the smallest on top, or the largest if `rising`
    values: Floats | None = None
    shades: Shades | None = None
    rising: bool = False


@dataclass(frozen=True, eq=False)
class Line(Mark):
    """A line through (n, 2) points, or several lines; `dash` style."""

    places: Floats | Sequence[Floats]
    colour: str = INK
    width: float = 1.5
    dash: str = ""
    opacity: float = 1.0

    @property
    def lines(self) -> Sequence[Floats]:
        places = self.places
        return [places] if isinstance(places, np.ndarray) and places.ndim == 2 else [*places]


@dataclass(frozen=True, eq=False)
class Arrows(Mark):
    """Arrows from (n, 2) points by vectors; shaft `width` in panels."""

    places: Floats
    vectors: Floats
    colours: str | Sequence[str]
    width: float


@dataclass(frozen=True, eq=False)
class Polygons(Mark):
    """Closed outlines through (v, 2) points; without an edge they are one area, with holes."""

    places: Floats | Sequence[Floats]
    face: str
    face_opacity: float = 1.0
    edge: str = ""
    edge_opacity: float = 1.0
    width: float = 0.0
    layer: float = field(default=1.0, kw_only=True)


@dataclass(frozen=True, eq=False)
class Ellipses(Mark):
    """Ellipses about (n, 2) points: semi-axes and degrees from horizontal.

    With `fill`, an opacity, ellipses are filled and without outline.
    """

    places: Floats
    semi_axes: Floats
    angles: Floats
    colour: str
    width: float
    fill: float = 0.0


@dataclass(frozen=True, eq=False)
class Mesh(Mark):
    """Equal cells between corners, coloured by values; NaN: empty."""

    corners: Floats
    values: Floats
    shades: Shades
    layer: float = field(default=1.0, kw_only=True)


@dataclass(frozen=True, eq=False)
class Texts(Mark):
    """Words at (n, 2) points, which are their `start`, `middle` or `end`; upwards if `turned`."""

    places: Floats
    texts: Sequence[str]
    size: float
    colours: str | Sequence[str] = INK
    anchor: str = "start"
    turned: bool = False
    layer: float = field(default=3.0, kw_only=True)


@dataclass(frozen=True, eq=False)
class Names(Mark):
    """Names near (n, 2) points, or `centred`, if space; none covers other points or `avoid`."""

    places: Floats
    texts: Sequence[str]
    colours: Sequence[str]
    avoid: Floats = field(default_factory=lambda: NOWHERE)
    centred: bool = False
    layer: float = field(default=9.0, kw_only=True)


def horizontal_line(height: float, colour: str, width: float = 0.5, dash: str = "") -> Line:
    """Return a horizontal line over the whole panel."""
    return Line(np.array([[-np.inf, height], [np.inf, height]]), colour, width, dash)


def band(across: Floats, low: Floats, high: Floats, colour: str, opacity: float, label: str = "") -> Polygons:
    """Return the area between two curves over (n,) `across`."""
    lower, upper = (np.column_stack([across, each]) for each in (low, high))
    return Polygons(np.concatenate([lower, upper[::-1]])[np.newaxis], colour, opacity, label=label)


def boxes(low: Floats, high: Floats) -> Floats:
    """Return (n, 4, 2) outlines of boxes from lower left to upper right."""
    corners = [low, np.column_stack([high[:, 0], low[:, 1]]), high, np.column_stack([low[:, 0], high[:, 1]])]
    return np.stack(corners, axis=1)


def ellipse_axes(covariances: Floats) -> tuple[Floats, Floats]:
    """Return (n, 2) semi-axes and (n,) degrees of (n, 2, 2) covariances."""
    (across, between), (_, up) = covariances.transpose(1, 2, 0)
    middle, half = 0.5 * (across + up), np.hypot(0.5 * (across - up), between)
    angles = np.degrees(0.5 * np.arctan2(between, 0.5 * (across - up)))
    return np.sqrt(np.maximum(np.column_stack([middle + half, middle - half]), 0.0)), angles


def error_bars(places: Floats, low: Floats, high: Floats) -> Floats:
    """Return (n, 2, 2) ends of vertical bars through (n, 2) points."""
    return np.stack([np.column_stack([places[:, 0], each]) for each in (low, high)], axis=1)


MAPS = {
    # Of the 256 colours of cividis (Nunez, Anderton and Renslow, PLoS ONE 13, 2018); linear interpolation
    # between these is within 4 of 255 of all.
    "ordered": (
        (0, 21, 34, 52, 147, 179, 205, 232, 251, 255),
        "00224e 003170 1e3a6f 36466c 8f8a78 aea371 c9b965 e7d150 fde334 fee838",
    ),
    "signed": ((0, 127.5, 255), f"{BLUE[1:]} ffffff {VERMILION[1:]}"),
}


def rgb(shades: Shades, values: Floats) -> Indices:
    """Return (..., 3) red, green, blue, 0 to 255; clipped at the ends."""
    places, written = MAPS[shades.map]
    colours = np.array([list(bytes.fromhex(colour)) for colour in written.split()])
    parts = 255.0 * shades.parts(values)
    return np.stack([np.interp(parts, places, own) for own in colours.T], axis=-1).round().astype(np.int64)


def hexadecimal(colour: Indices) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour.tolist())


def contours(
    across: Floats,
    up: Floats,
    values: Floats,
    levels: Floats,
    shades: Shades,
    colour: str = "white",
    width: float = 0.9,
    steps: int = 1,
) -> list[Mark]:
    """Return areas and lines of the contours of (rows, columns) values, with the levels of long lines.

    Levels ascend; there are `steps` colours between two of them. Cells with NaN are empty.
    """
    need("contourpy")
    from contourpy import FillType, LineType, contour_generator  # part of matplotlib, fast to import

    kinds: Any = {"fill_type": FillType.OuterOffset, "line_type": LineType.Separate}
    made: Any = contour_generator(across, up, np.ma.masked_invalid(values), **kinds)
    places = np.interp(
        np.arange(steps * (len(levels) - 1) + 1) / steps, np.arange(len(levels)), shades.parts(levels)
    )
    bounds = shades.values(places)
    beyond = max(np.nanmax(values), bounds[-1]) + 1.0
    # Values below the first level have its colour as well; each area covers the previous ones, without seams.
    lows = [np.nanmin(values) - 1.0, *bounds[1:-1].tolist()]
    marks: list[Mark] = []
    for low, tone in zip(lows, rgb(shades, shades.values((places[:-1] + places[1:]) / 2)), strict=True):
        filled = zip(*made.filled(low, beyond), strict=True)
        rings = [ring for outlines, ends in filled for ring in np.split(outlines, ends[1:-1])]
        marks.append(Polygons(rings, hexadecimal(tone)))
    written = [
        (f"{level:g}".replace("-", "−"), line) for level in levels.tolist() for line in made.lines(level)
    ]
    lines = [line for _, line in written]
    # Names of adjacent lines are at different parts of these.
    texts, at = [], []
    for k, (text, line) in enumerate(written):
        if np.hypot(*np.diff(line, axis=0).T).sum() > 0.1 * max(np.ptp(across), np.ptp(up)):
            texts.append(text)
            at.append(line[int(len(line) * (0.5, 0.3, 0.7)[k % 3])])
    names = Names(np.reshape(at, (-1, 2)), texts, [INK] * len(at), centred=True)
    return [*marks, Line(lines, colour, width, layer=1.0), names]


ScaleBar: TypeAlias = tuple[float, str, str]
"""Length in the unit of the horizontal axis, colour, and meaning."""


@dataclass(frozen=True, eq=False)
class Panel:
    """One pair of axes with its marks."""

    limits: Floats  # (2, 2) values at the lower left and at the upper right corner
    marks: Sequence[Mark] = ()
    title: str = ""
    across: str = ""
    up: str = ""
    equal: bool = False  # Whether both axes have the same scale
    notes: Sequence[str] = ()  # Notes below the panel
    bars: Sequence[ScaleBar] = ()  # Scale bars of enlarged marks, below the title
    legend: Literal["", "beside", "below"] = ""  # Position of the legend, outside the panel
    # Names at 0, 1, 2 ... instead of numbers
    across_names: Sequence[str] = ()
    up_names: Sequence[str] = ()
    turned: bool = False  # Whether names of the horizontal axis are vertical
    bare: bool = False  # Without axes and numbers; names remain
    # Logarithmic axes
    log_across: bool = False
    log_up: bool = False
    shades: Shades | None = None  # Colour bar of the panel
    decimal: str = "."  # Decimal sign

    @property
    def labelled(self) -> list[Mark]:
        return [mark for mark in self.marks if mark.label]

    def even(self, places: Floats) -> Floats:
        """Return (..., 2) positions with logarithms along logarithmic axes."""
        log = np.array([self.log_across, self.log_up])
        return np.where(log, np.log10(np.where(log, places, 1.0)), places) if log.any() else places


@dataclass(frozen=True, eq=False)
class Sketch:
    """A plot: its panels row by row, None if empty."""

    # Maximum size, inches
    width: float
    height: float
    panels: Sequence[Panel | None]
    columns: int = 1
    shared: bool = False  # Numbers across only below the lowest panel of a column
    title: str = ""

    @property
    def rows(self) -> int:
        """Number of rows of panels."""
        return -(-len(self.panels) // self.columns)


def spread(*values: Floats | float) -> tuple[float, float]:
    every = np.concatenate([np.ravel(each) for each in values])
    every = every[np.isfinite(every)]
    low, high = (float(every.min()), float(every.max())) if every.size else (0.0, 0.0)
    # The margin of matplotlib: a twentieth on either side.
    room = 0.05 * (high - low) or 0.05 * (abs(low) or 1.0)
    return low - room, high + room


def around(places: Floats, part: float = 0.08) -> Floats:
    """Return (2, 2) limits around (n, 2) points with a relative margin."""
    low, high = places.min(axis=0), places.max(axis=0)
    room = part * (float((high - low).max()) or 1.0)
    return np.array([low - room, high + room])
