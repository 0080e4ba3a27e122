"""Redundancy numbers over the frame and over the network: where gross errors would show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.plots.cells import Cells, cells
from photogram.plots.network import thinned, view_of_plan
from photogram.plots.panels import Where, handed_out, note, panels
from photogram.plots.picture_data import Images, Pictured, pictured
from photogram.plots.residuals import frame
from photogram.show.style import INK, ORDERED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SINGLE = 600
"""Image points that are drawn one by one at most."""
CELLS = 16
"""Along the longer side of the frame."""
POINTS = 6000
"""Points of the network that are drawn one by one at most; of more, the means of cells."""
CELLS_OF_PLAN = 60
"""Along the longer side of the network."""
PHOTOS = 1000
"""That are marked at most."""


def redundancy(result: object, ax: Where = None) -> Any:
    """Draw redundancy numbers of images over the frame of all cameras, and of points over the network.

    A redundancy number is the part of an error that shows in the residual of its own observation: 0 hides
    it, 1 shows all of it. Drawn are means of x and y.

    Parameters
    ----------
    result
        An adjusted block or collection.
    ax
        Two axes, or a figure to put them in; a new one when None.

    Returns
    -------
    An array of two axes: the frame, the network.

    Raises
    ------
    InputError
        The adjustment gave no redundancy numbers (`covariance=False`); another number of axes.
    ModuleNotFoundError
        matplotlib is absent (`pip install 'photogram[plots]'`).
    TypeError
        A result without photos and points.
    """
    drawn = pictured(result)
    images = drawn.images
    values = images.redundancy.mean(axis=1)
    if not np.isfinite(values).any():
        raise InputError("there are no redundancy numbers: adjust with covariance=True")
    with panels(ax, 1, 2, 10.5, 4.9) as found:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        _over_frame(found[0], images, values)
        _over_network(found[1], drawn, values)
        figure = found[1].get_figure()
        assert figure is not None
        colours = ScalarMappable(Normalize(0.0, 1.0), ORDERED)
        figure.colorbar(colours, ax=found[1], label="redundancy number, 0 to 1", aspect=30, shrink=0.85)
    return handed_out(found)


def _over_frame(axes: Axes, images: Images, values: Floats) -> None:
    """Draw the images of frames; those of scanners, samples and lines, where there are no others."""
    scanned = bool(images.scanned.any() and images.scanned.all())
    kept = ~images.scanned if images.scanned.any() and not scanned else np.ones(len(values), dtype=bool)
    xy, shown = images.xy[kept], values[kept]
    said = "" if kept.all() else f"{np.count_nonzero(~kept):,} images of scanners are left out"
    grid = cells(xy, CELLS)
    frame(axes, images, grid.edges, scanned=scanned)
    over = "samples and lines" if scanned else "the frame"
    axes.set_title(f"Over {over}: mean {np.nanmean(shown):.2f}, least {np.nanmin(shown):.2f}")
    if len(shown) <= SINGLE:
        axes.scatter(xy[:, 0], xy[:, 1], c=shown, s=14.0, cmap=ORDERED, vmin=0.0, vmax=1.0, linewidths=0)
        note(axes, [said])
    else:
        note(axes, [_mesh(axes, grid, shown, "images"), said])


def _over_network(axes: Axes, drawn: Pictured, values: Floats) -> None:
    """Draw points in the colour of the least checked of their images, of many the means of cells."""
    plan, images = drawn.plan, drawn.images
    least = np.full(len(plan.points), np.inf)
    np.minimum.at(least, images.points, values)
    rows = np.flatnonzero(np.isfinite(least) & np.isfinite(plan.points).all(axis=1))
    seen = view_of_plan(axes, plan)
    places = plan.points[rows][:, list(seen[:2])]
    limits = np.array([axes.get_xlim(), axes.get_ylim()]).T
    inside = ((places >= limits[0]) & (places <= limits[1])).all(axis=1)
    rows, places = rows[inside], places[inside]
    axes.set_title("Over the network: the least of the images of a point")
    if len(rows) > POINTS:
        note(axes, [_mesh(axes, cells(places, CELLS_OF_PLAN), least[rows], "points")])
    else:
        # The least on top: they are what a reader looks for.
        order = np.argsort(-least[rows], kind="stable")
        axes.scatter(
            places[order, 0],
            places[order, 1],
            c=least[rows][order],
            s=float(np.clip(9000.0 / max(len(rows), 1), 3.0, 20.0)),
            cmap=ORDERED,
            vmin=0.0,
            vmax=1.0,
            linewidths=0,
            rasterized=len(rows) > 1500,
        )
    photos, _ = thinned("photos", np.arange(len(plan.photos)), PHOTOS)
    axes.plot(
        *plan.photos[photos][:, list(seen[:2])].T,
        "+",
        color=INK,
        markersize=3.0,
        markeredgewidth=0.5,
        alpha=0.5,
    )


def _mesh(axes: Axes, grid: Cells, values: Floats, what: str) -> str:
    """Draw the means of cells, and return what they are."""
    (left, low), (right, high) = grid.edges
    axes.pcolormesh(
        np.linspace(left, right, grid.columns + 1),
        np.linspace(low, high, grid.rows + 1),
        np.ma.masked_invalid(grid.means(values).reshape(grid.rows, grid.columns)),
        cmap=ORDERED,
        vmin=0.0,
        vmax=1.0,
        rasterized=True,
    )
    return f"means of cells with {grid.counts[grid.counts > 0].min():,} to {grid.counts.max():,} {what}"
