"""Plots of a statement: check point differences, and photos per position."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import replace
from photogram.results.footprints import footprints
from photogram.results.statement.comparison import Compared
from photogram.results.statement.standards import Lengths
from photogram.results.statement.texts import Texts
from photogram.show.sketch.marks import (
    Arrows,
    Ellipses,
    Line,
    Mark,
    Markers,
    Mesh,
    Names,
    Panel,
    ScaleBar,
    Shades,
    around,
    ellipse_axes,
    error_bars,
    horizontal_line,
    spread,
)
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, SOFT, VERMILION, round_length

if TYPE_CHECKING:
    from photogram import Result

WIDTH = 6.3  # Inches
REACH = 0.08  # Length of the largest arrow relative to the extent
NINETY_FIVE = 2.4477  # Semi-axes of the ellipse of 95 percent, in standard deviations
NAMED = 60
CELLS = 120  # Along the longer side of the map of overlap


def differences(found: Compared, control: Floats, texts: Texts) -> Plot | None:
    """Draw (k, 3) control, check points and differences, heights as colours."""
    if not len(found) and not len(control):
        return None
    places = np.concatenate([each[:, :2] for each in (found.places, control) if len(each)])
    extent = np.ptp(places, axis=0)
    panel = _in_plan(around(places, 0.12), texts)
    marks = list[Mark]()
    if len(control):
        marks.append(Markers(control[:, :2], "^", 6.0, SOFT, label=texts("use.control")))
    if len(found):
        panel = _points(panel, found, float(extent.max()), texts)
    height = float(np.clip(WIDTH * (extent[1] + 1e-9) / (extent[0] + 1e-9), 2.6, WIDTH))
    return Plot(WIDTH, height, [replace(panel, marks=[*marks, *panel.marks], legend="beside")])


def _in_plan(limits: Floats, texts: Texts) -> Panel:
    across, up = (f"{texts(f'column.{axis}')}, {texts.unit}" for axis in ("east", "north"))
    return Panel(limits, across=across, up=up, equal=True, decimal=texts("number.decimal"))


def _points(panel: Panel, found: Compared, extent: float, texts: Texts) -> Panel:
    plan, d = found.places[:, :2], found.differences
    heights = np.where(np.isfinite(d[:, 2]), d[:, 2], 0.0)
    most = max(float(np.abs(heights).max()), 1e-12)
    shades = Shades(-most, most, f"{texts('component.h')}, {texts.unit}", "signed")
    marks: list[Mark] = [
        Markers(plan, "s", 5.1, edge=0.0, values=heights, shades=shades, layer=3.0),
        Markers(plan, "s", 5.1, face="none", edge=0.5, label=texts("use.check"), layer=3.5),
    ]
    bars: list[ScaleBar] = []
    both = np.isfinite(d[:, :2]).all(axis=1)
    if both.any():
        largest = max(float(np.hypot(*d[both, :2].T).max()), 1e-12)
        scale = REACH * max(extent, 1e-9) / largest
        semi_axes, angles = ellipse_axes(found.blocks(found.covariance)[both, :2, :2])
        marks += [
            Ellipses(plan[both], NINETY_FIVE * scale * semi_axes, angles, BLUE, 0.6),
            Arrows(plan[both], scale * d[both, :2], VERMILION, 0.003, layer=4.0),
        ]
        length = round_length(largest)
        sizes = (f"{size:.3g} {texts.unit}" for size in (length, length * scale))
        bars.append((length * scale, VERMILION, " = ".join(sizes).replace(".", texts("number.decimal"))))
    if len(found) <= NAMED:
        marks.append(Names(plan, found.names, [SOFT] * len(found)))
    return replace(panel, marks=marks, bars=bars, shades=shades)


def lengths(found: Lengths, texts: Texts) -> Plot:
    """Draw errors of calibrated lengths by length, with sd and limits."""
    test, order = found.test, np.argsort(found.calibrated, kind="stable")
    places = np.column_stack([found.calibrated, test.errors])
    ends = [test.errors - test.sd, test.errors + test.sd]
    marks: list[Mark] = [
        Line(error_bars(places, *ends), BLUE, 0.7),
        Markers(places, "o", 3.0, BLUE),
        horizontal_line(0.0, SOFT, 0.6),
    ]
    if test.limits is not None:
        for limit in (test.limits, -test.limits):
            ends.append(limit)
            line = np.column_stack([found.calibrated, limit])[order]
            marks.append(Line(line, VERMILION, 0.9, "--"))
    limits = np.column_stack([spread(found.calibrated), spread(0.0, *ends)])
    across, up = (f"{texts(f'column.{name}')}, {texts.unit}" for name in ("length", "error"))
    return Plot(WIDTH, 3.0, [Panel(limits, marks, "", across, up, decimal=texts("number.decimal"))])


def overlap(result: Result, texts: Texts) -> Plot | None:
    """Draw the number of photos of ground positions; None without footprints."""
    outlines = footprints(result).outlines[:, :, :2]
    outlines = outlines[np.isfinite(outlines).all(axis=(1, 2))]
    if not len(outlines):
        return None
    low, high = outlines.min(axis=(0, 1)), outlines.max(axis=(0, 1))
    cell = float((high - low).max()) / CELLS
    if not cell > 0:
        return None
    x, y = (np.arange(low[k] + cell / 2, high[k], cell) for k in (0, 1))
    counts = photos_per_place(outlines, x, y)
    shades = Shades(0.0, float(counts.max()) or 1.0, texts("column.photos"))
    corners = np.array([low, low + cell * np.array([len(x), len(y)])])
    cells = Mesh(corners, np.where(counts > 0, counts, np.nan), shades)
    panel = replace(_in_plan(corners, texts), marks=[cells], shades=shades)
    return Plot(WIDTH, float(np.clip(WIDTH * len(y) / len(x), 2.4, WIDTH)), [panel])


def photos_per_place(outlines: Floats, x: Floats, y: Floats) -> Floats:
    """Return (len(y), len(x)) numbers of closed outlines around grid positions."""
    counts = np.zeros((len(y), len(x)))
    for outline in outlines:
        columns = np.flatnonzero((x >= outline[:, 0].min()) & (x <= outline[:, 0].max()))
        rows = np.flatnonzero((y >= outline[:, 1].min()) & (y <= outline[:, 1].max()))
        if len(columns) and len(rows):
            grid = np.stack(np.meshgrid(x[columns], y[rows]), axis=-1).reshape(-1, 2)
            counts[np.ix_(rows, columns)] += _inside(grid, outline).reshape(len(rows), len(columns))
    return counts


def _inside(places: Floats, outline: Floats) -> Bools:
    """Return positions inside an outline by odd crossings of lines to the east."""
    x, y = places[:, :1], places[:, 1:]
    (x0, y0), (x1, y1) = outline[:-1].T, outline[1:].T
    crosses = (y0 > y) != (y1 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
    return np.asarray((crosses & (x < at)).sum(axis=1) % 2 == 1)
