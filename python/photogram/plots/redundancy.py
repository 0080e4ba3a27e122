"""Redundancy numbers over frame and network, which show detectable errors."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import replace
from photogram.plots.network import View
from photogram.plots.picture_data import Images, Pictured
from photogram.plots.residuals import frame
from photogram.plots.selection import Cells, cells, thinned
from photogram.show.sketch.marks import Mark, Markers, Mesh, Panel, Shades
from photogram.show.sketch.plot import Plot
from photogram.words import phrase

MAX_SINGLE_IMAGES = 600  # More image points are drawn as means of cells
CELLS_OF_FRAME = 16  # Along the longer side
MAX_SINGLE_POINTS = 6000  # More points of the network are drawn as means of cells
CELLS_OF_NETWORK = 60  # Along the longer side
MAX_PHOTOS = 1000
SHADES = Shades(0.0, 1.0, "redundancy number, 0 to 1")


def redundancy(result: Any) -> Plot:
    """Plot redundancy numbers of observations over frames, and of points in plan.

    A redundancy number is the part of an error that is visible in the residual of its own observation, from 0
    (nothing) to 1 (all). Values are means of x and y.

    Raises
    ------
    InputError
        If redundancy numbers were not computed (`covariance=False`).
    """
    drawn = result._plot_data()
    images = drawn.images
    values = images.redundancy.mean(axis=1)
    if not np.isfinite(values).any():
        raise InputError(phrase("plot.redundancy"))
    return Plot(10.5, 4.9, [_over_frame(images, values), _over_network(drawn, values)], 2)


def _over_frame(images: Images, values: Floats) -> Panel:
    """Return observations over frames, or samples and lines if all are scanned."""
    scanned = bool(images.scanned.all())
    kept = ~images.scanned | scanned
    xy, shown = images.xy[kept], values[kept]
    said = "" if kept.all() else f"{np.count_nonzero(~kept):,} images of scanners are left out"
    grid = cells(xy, CELLS_OF_FRAME)
    over = "samples and lines" if scanned else "the frame"
    many = len(shown) > MAX_SINGLE_IMAGES
    marks, cells_are = _shaded(xy, shown, np.sqrt(14.0), grid if many else None, "images")
    return replace(
        frame(images, grid.edges, scanned=scanned),
        marks=[marks],
        title=f"Over {over}: mean {np.nanmean(shown):.2f}, least {np.nanmin(shown):.2f}",
        notes=[cells_are, said],
    )


def _over_network(drawn: Pictured, values: Floats) -> Panel:
    """Return points coloured by least redundancy number, or means of cells."""
    view, images = View(drawn.plan), drawn.images
    least = np.full(len(view.points), np.inf)
    np.minimum.at(least, images.points, values)
    rows = np.flatnonzero(np.isfinite(least) & view.known & view.inside)
    places = view.points[rows]
    size = float(np.sqrt(np.clip(9000.0 / max(len(rows), 1), 3.0, 20.0)))
    grid = cells(places, CELLS_OF_NETWORK) if len(rows) > MAX_SINGLE_POINTS else None
    points, cells_are = _shaded(places, least[rows], size, grid, "points")
    photos, _ = thinned("photos", np.arange(len(view.photos)), MAX_PHOTOS)
    stations = Markers(view.photos[photos], "+", 3.0, edge=0.5, opacity=0.5)
    title = "Over the network: the least of the images of a point"
    return view.panel([points, stations], title=title, notes=[cells_are], shades=SHADES)


def _shaded(places: Floats, values: Floats, size: float, grid: Cells | None, what: str) -> tuple[Mark, str]:
    """Return coloured points, or the means of cells with a note."""
    if grid is None:
        return Markers(places, "o", size, values=values, shades=SHADES, layer=1.0), ""
    means = grid.means(values).reshape(grid.rows, grid.columns)
    counts = grid.counts[grid.counts > 0]
    note = f"means of cells with {counts.min():,} to {counts.max():,} {what}"
    return Mesh(grid.edges, means, SHADES), note
