"""What panels of pictures are made of: marks in the units of their axes, sizes in points (1/72 inch).

A mark with a `label` stands in the legend; those of a higher `layer` lie over others.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, field
from photogram.show.style import INK

NOWHERE = np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class Shades:
    """Colours of values from `low` to `high`: of the map `ordered` or `signed`; `label` of their bar."""

    low: float
    high: float
    label: str
    map: str = "ordered"


@dataclass(frozen=True, eq=False)
class Markers:
    """Small signs at (n, 2) places.

    Attributes
    ----------
    shape, size
        As matplotlib has them: `.`, `o`, `+`, `^`, `s`, `D`, and the markersize.
    face
        Colour within the outline; that of the outline where nothing is given.
    edge
        Width of the outline.
    values, shades
        (n,) values whose colours the markers have, the smallest on top.
    """

    places: Floats
    shape: str
    size: float
    colour: str = INK
    face: str = ""
    edge: float = 1.0
    opacity: float = 1.0
    values: Floats | None = None
    shades: Shades | None = None
    label: str = ""
    layer: float = 2.0


@dataclass(frozen=True, eq=False)
class Line:
    """A line through (n, 2) places; `dash` is nothing, `--` or `:`."""

    places: Floats
    colour: str = INK
    width: float = 1.5
    dash: str = ""
    opacity: float = 1.0
    label: str = ""
    layer: float = 2.0


@dataclass(frozen=True, eq=False)
class Level:
    """A line over the whole panel at a height."""

    height: float
    colour: str
    width: float = 0.5
    dash: str = ""
    label: str = ""
    layer: float = 2.0


@dataclass(frozen=True, eq=False)
class Segments:
    """Straight lines between (n, 2, 2) ends."""

    ends: Floats
    colour: str
    width: float
    label: str = ""
    layer: float = 2.0


@dataclass(frozen=True, eq=False)
class Arrows:
    """Arrows from (n, 2) places by (n, 2) vectors, in one colour or n; `width` of the shaft in panels."""

    places: Floats
    vectors: Floats
    colours: str | Sequence[str]
    width: float
    label: str = ""
    layer: float = 2.0


@dataclass(frozen=True, eq=False)
class Polygons:
    """(n, v, 2) closed outlines; colours and opacities of their insides and edges."""

    outlines: Floats
    face: str
    face_opacity: float
    edge: str
    edge_opacity: float
    width: float
    label: str = ""
    layer: float = 1.0


@dataclass(frozen=True, eq=False)
class Ellipses:
    """Ellipses about (n, 2) places: (n, 2) semi-axes, and (n,) degrees from the axis across to the first."""

    places: Floats
    semi_axes: Floats
    angles: Floats
    colour: str
    width: float
    label: str = ""
    layer: float = 2.0


@dataclass(frozen=True, eq=False)
class Mesh:
    """Equal cells from the first corner to the second in the colours of (rows, columns) values; NaN: none."""

    corners: Floats
    values: Floats
    shades: Shades
    label: str = ""
    layer: float = 1.0


@dataclass(frozen=True, eq=False)
class Band:
    """What lies between two curves over (n,) `across`."""

    across: Floats
    low: Floats
    high: Floats
    colour: str
    opacity: float
    label: str = ""
    layer: float = 1.0


@dataclass(frozen=True, eq=False)
class Texts:
    """Words in the middle of (n, 2) places."""

    places: Floats
    texts: Sequence[str]
    colours: Sequence[str]
    size: float
    label: str = ""
    layer: float = 3.0


@dataclass(frozen=True, eq=False)
class Names:
    """Names beside (n, 2) places, where there is room: they cover no other place, and none to `avoid`."""

    places: Floats
    texts: Sequence[str]
    colours: Sequence[str]
    avoid: Floats = field(default_factory=lambda: NOWHERE)
    label: str = ""
    layer: float = 9.0


Mark: TypeAlias = (
    Markers | Line | Level | Segments | Arrows | Polygons | Ellipses | Mesh | Band | Texts | Names
)


def bars(edges: Floats, heights: Floats, colour: str, opacity: float, label: str) -> Band:
    """Return a histogram, of (n + 1,) edges and (n,) heights from 0, as the band that it is."""
    across, up = np.repeat(edges, 2)[1:-1], np.repeat(heights, 2)
    return Band(across, np.zeros(len(up)), up, colour, opacity, label)
