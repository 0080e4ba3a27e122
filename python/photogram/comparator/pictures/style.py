"""What the pictures share: colours, panels, scales of vectors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.show.sketch.declared import Panel, around
from photogram.show.sketch.marks import Arrows, Mark, Markers
from photogram.show.style import BLUE, FAINT, VERMILION

if TYPE_CHECKING:
    from photogram.arguments.types import Floats

MAIN, ACCENT = BLUE, VERMILION
MM = 1000.0
PANELS_ACROSS = 4
OF_PLATE = ("X of the plate, mm", "Y of the plate, mm")
OF_COMPARATOR = ("x, mm", "y, mm")


def plan(
    limits: Floats,
    marks: Sequence[Mark],
    title: str,
    axes: tuple[str, str],
    key: tuple[float, float] | None = None,
) -> Panel:
    """Return a map of equal scales; `key`: mm for a micrometre, and micrometres that are shown."""
    bars = [(key[0] * key[1], ACCENT, f"{key[1]:g} µm")] if key else []
    return Panel(limits, marks, title, *axes, equal=True, bars=bars)


def magnification(places_mm: Floats, vectors_um: Floats) -> float:
    """Return millimetres of the picture a micrometre: the longest vector almost spans the spacing."""
    longest = float(np.hypot(*vectors_um.T).max(initial=0.0))
    return 0.9 * spacing(places_mm) / longest if longest > 0 else 1.0


def spacing(places: Floats) -> float:
    """Return how far places are apart, which fill a square."""
    extent = float(np.ptp(places, axis=0).max()) or 1.0
    return extent / max(math.sqrt(len(places)) - 1, 1)


def arrows(places_um: Floats, vectors_um: Floats, scale: float, colour: str = MAIN) -> list[Mark]:
    """Return vectors from places, `scale` millimetres of the picture for each micrometre."""
    places = places_um / MM
    dots = Markers(places, ".", 5.0, FAINT, layer=1.0)
    return [dots, Arrows(places, vectors_um * scale, colour, 0.006)]


def limits_of(places_um: Floats, vectors_um: Floats, scale: float) -> Floats:
    """Return the limits of a map of vectors."""
    return around(np.vstack([places_um / MM, places_um / MM + vectors_um * scale]))
