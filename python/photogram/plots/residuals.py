"""Residuals and redundancy numbers of images, residuals of fiducial marks and film patterns, over frames."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from photogram.arguments.arrays import bounds
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import replace
from photogram.plots.network import View
from photogram.plots.picture_data import Images, VectorField, display_unit
from photogram.plots.selection import Cells, cells, first_panels, thinned
from photogram.show.sketch.marks import Arrows, Mark, Markers, Mesh, Names, Panel, ScaleBar, Shades, around
from photogram.show.sketch.plot import Plot, side_by_side
from photogram.show.style import FAINT, INK, MARKED, round_length
from photogram.words import phrase

MAX_SINGLE_IMAGES = 900  # More image points of a camera are drawn as means of cells
MAX_CELLS = 16  # Along the longer side of the frame
MEAN_IMAGES_OF_CELL = 12
MAX_CAMERAS = 6  # Cameras with the most observations
MIN_IMAGES = 8
MARGIN = 0.06  # Around the frame, as a part of its longer side
LONGEST_VECTOR = 2.5  # Multiple of the typical vector; longer vectors are cut short
MAX_FIELDS = 6  # Of films
MARGIN_OF_FIELD = 0.18  # Margin around the points of a film, as a part of their extent
LONGEST_OF_FIELD = 0.17  # Its longest vector, as a part of the extent of the points
LEVEL = 0.01  # Probability of a false alarm in any cell of a panel


def residuals(result: Any) -> Plot:
    """Plot image residuals over the frame of each camera, or means of cells.

    Significant means are coloured (1 percent for all cells together).
    """
    images = result._plot_data().images
    counts = np.bincount(images.cameras, minlength=len(images.names))
    there = int((counts > 0).sum())
    chosen = np.sort(np.argsort(-counts, kind="stable")[: min(MAX_CAMERAS, there)]).tolist()
    cameras, left_out = chosen or [0], ""
    if there > MAX_CAMERAS:
        left_out = f"{len(chosen)} of {there} cameras are drawn, those with the most images"
    columns = min(3, len(cameras))
    rows = -(-len(cameras) // columns)
    width = 6.4 if columns == 1 else 4.2 * columns
    shown = images.xy[images.cameras == cameras[0]]
    extent = np.ptp(bounds(shown), axis=0) if len(shown) else np.ones(2)
    across, up = np.maximum(extent + 2 * MARGIN * extent.max(), 1e-12)
    many = np.bincount(images.cameras[np.isin(images.cameras, cameras)]).max(initial=0) > MAX_SINGLE_IMAGES
    # Title, scale and labels; for means, also an explanation.
    beside = 1.95 if many else 1.25
    high = rows * (float(np.clip(up / across, 0.3, 1.5)) * (width / columns - 0.75) + beside)
    found = [_field(images, camera, left_out if camera == cameras[-1] else "") for camera in cameras]
    return Plot(width, high, found, columns)


def frame(images: Images, edges: Floats, *, scanned: bool = False) -> Panel:
    """Return a panel of a camera frame with equal scales and a margin.

    Samples and lines of a scanner increase upwards, so that residuals have the direction of its focal plane.
    """
    margin = MARGIN * float((edges[1] - edges[0]).max())
    limits = edges + margin * np.array([[-1.0], [1.0]])
    if images.down and not scanned:
        limits[:, 1] = limits[::-1, 1]
    across, up = ("sample", "line") if scanned else (f"x, {images.unit}", f"y, {images.unit}")
    return Panel(limits, across=across, up=up, equal=True)


def _field(images: Images, camera: int, left_out: str) -> Panel | None:
    own = images.cameras == camera
    xy, vectors = images.xy[own], images.residuals[own]
    factor, unit = display_unit(images.unit)
    if not len(xy):
        return None
    longer = int(np.clip(np.sqrt(len(xy) / MEAN_IMAGES_OF_CELL), 6, MAX_CELLS))
    grid, many = cells(xy, longer), len(xy) > MAX_SINGLE_IMAGES
    scanned = bool(images.scanned[own].any())
    places, shown, colours, remark = _means(grid, vectors) if many else (xy, vectors, INK, [])
    marks: list[Mark] = [Markers(places, ".", 2.0, FAINT, layer=1.0)]
    bars, cut, lengths = list[ScaleBar](), 0, np.hypot(*shown.T)
    size = float(np.quantile(lengths, 0.9)) if len(shown) else 0.0
    if size > 0:
        extent = float((grid.edges[1] - grid.edges[0]).max())
        scale = (0.7 / longer if many else 0.045) * extent / size
        longest = LONGEST_VECTOR * 0.1 * extent / scale
        cut = int((lengths > longest).sum())
        shown = shown * np.minimum(1.0, longest / np.maximum(lengths, 1e-300))[:, np.newaxis]
        marks.append(Arrows(places, scale * shown, colours, 0.0028))
        bar = round_length(0.15 * extent / scale * factor)
        bars = [(scale * bar / factor, INK, f"{bar:g} {unit}")]
    rms = np.sqrt((vectors**2).mean(axis=0)) * factor
    in_plane = "vectors: x to the right and y up, in the focal plane" if scanned else ""
    return replace(
        frame(images, grid.edges, scanned=scanned),
        marks=marks,
        title=f"{images.names[camera]}: {len(xy):,} images, rms {rms[0]:.3g}, {rms[1]:.3g} {unit}",
        notes=[*remark, in_plane, f"vectors that are longer and cut short: {cut}" if cut else "", left_out],
        bars=bars,
    )


def _means(grid: Cells, vectors: Floats) -> tuple[Floats, Floats, str | list[str], list[str]]:
    from photogram.statistics.distributions import critical_chi_square

    means = np.column_stack([grid.means(vectors[:, axis]) for axis in (0, 1)])
    variance = (vectors**2).mean(axis=0)
    filled = np.flatnonzero(grid.counts >= min(MIN_IMAGES, int(grid.counts.max())))
    with np.errstate(invalid="ignore", divide="ignore"):
        square = (means[filled] ** 2 * grid.counts[filled, np.newaxis] / variance).sum(axis=1)
    beyond = square > critical_chi_square(LEVEL / len(filled), 2)
    colours = np.where(beyond, MARKED, INK).tolist()
    ends = dict.fromkeys(f"{end(grid.counts[filled]):,}" for end in (np.min, np.max))
    said = [
        f"means of cells with {' to '.join(ends)} images,",
        f"those with less than {MIN_IMAGES} are left out",
    ]
    if beyond.any():
        said.append(f"{int(beyond.sum())} of {len(filled)} are larger than chance gives (coloured)")
    return grid.middles[filled], means[filled], colours, said


def films(result: Any) -> Plot:
    """Plot fiducial residuals, mean over photos of each camera, and film patterns.

    Raises
    ------
    InputError
        If there are neither marks nor patterns.
    """
    panels = first_panels("films", "fields", result._plot_data().films, MAX_FIELDS, vector_panel)
    return side_by_side(panels, 2, 4.8)


def vector_panel(each: VectorField, longest: float = math.nan) -> Panel:
    """Draw vectors with a scale bar; `longest` is the longest vector of panels with one scale."""
    extent = max(float(np.ptp(each.places, axis=0).max()), 1e-12)
    marks: list[Mark] = [Markers(each.places, ".", 4.0, FAINT, layer=1.0)]
    longest = float(np.hypot(*each.vectors.T).max(initial=0.0)) if math.isnan(longest) else longest
    bars: list[ScaleBar] = []
    x, y = each.axes
    if longest > 0:
        scale = LONGEST_OF_FIELD * extent / longest
        marks.append(Arrows(each.places, scale * each.vectors, INK, 0.004))
        bar = round_length(x.factor * longest)
        bars = [(scale * bar / x.factor, INK, f"{bar:g} {x.small}")]
    if each.labels:
        marks.append(Names(each.places, each.labels, [INK] * len(each.labels)))
    limits, across, up = around(each.places, MARGIN_OF_FIELD), f"{x.name}, {x.unit}", f"{y.name}, {y.unit}"
    return Panel(limits, marks, each.title, across, up, equal=True, bars=bars)


MAX_SINGLE_NUMBERS = 600  # More image points are drawn as means of cells
CELLS_OF_FRAME = 16  # Along the longer side
MAX_SINGLE_POINTS = 6000  # More points of the network are drawn as means of cells
CELLS_OF_NETWORK = 60  # Along the longer side
MAX_STATIONS = 1000
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
    # Observations over frames, or samples and lines if all are scanned.
    scanned = bool(images.scanned.all())
    kept = ~images.scanned | scanned
    xy, shown = images.xy[kept], values[kept]
    said = "" if kept.all() else f"{np.count_nonzero(~kept):,} images of scanners are left out"
    grid = cells(xy, CELLS_OF_FRAME)
    over = "samples and lines" if scanned else "the frame"
    many = len(shown) > MAX_SINGLE_NUMBERS
    marks, cells_are = _shaded(xy, shown, np.sqrt(14.0), grid if many else None, "images")
    over_frame = replace(
        frame(images, grid.edges, scanned=scanned),
        marks=[marks],
        title=f"Over {over}: mean {np.nanmean(shown):.2f}, least {np.nanmin(shown):.2f}",
        notes=[cells_are, said],
    )
    # Points coloured by least redundancy number, or means of cells.
    view = View(drawn.plan)
    least = np.full(len(view.points), np.inf)
    np.minimum.at(least, images.points, values)
    rows = np.flatnonzero(np.isfinite(least) & view.known & view.inside)
    places = view.points[rows]
    size = float(np.sqrt(np.clip(9000.0 / max(len(rows), 1), 3.0, 20.0)))
    of_places = cells(places, CELLS_OF_NETWORK) if len(rows) > MAX_SINGLE_POINTS else None
    points, cells_are = _shaded(places, least[rows], size, of_places, "points")
    photos, _ = thinned("photos", np.arange(len(view.photos)), MAX_STATIONS)
    stations = Markers(view.photos[photos], "+", 3.0, edge=0.5, opacity=0.5)
    title = "Over the network: the least of the images of a point"
    over_network = view.panel([points, stations], title=title, notes=[cells_are], shades=SHADES)
    return Plot(10.5, 4.9, [over_frame, over_network], 2)


def _shaded(places: Floats, values: Floats, size: float, grid: Cells | None, what: str) -> tuple[Mark, str]:
    """Return coloured points, or the means of cells with a note."""
    if grid is None:
        return Markers(places, "o", size, values=values, shades=SHADES, layer=1.0), ""
    means = grid.means(values).reshape(grid.rows, grid.columns)
    counts = grid.counts[grid.counts > 0]
    note = f"means of cells with {counts.min():,} to {counts.max():,} {what}"
    return Mesh(grid.edges, means, SHADES), note
