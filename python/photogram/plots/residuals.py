"""Image residuals as a field over the frame, camera by camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.plots.cells import Cells, cells
from photogram.plots.panels import Where, handed_out, note, panels, scale_bars
from photogram.plots.picture_data import Images, pictured
from photogram.show.pictures import round_length
from photogram.show.style import FAINT, INK, MARKED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SINGLE = 900
"""Image points of a camera whose residuals are drawn one by one at most; of more, the means of cells."""
CELLS = 16
"""Along the longer side of the frame at most."""
IN_CELL = 12
"""Images of a cell on the average, at least."""
CAMERAS = 6
"""That have a panel at most: those with the most images."""
FEWEST = 8
"""Images of a cell whose mean is drawn."""
ROOM = 0.06
"""Around the frame, of its longer side."""
LONGEST = 2.5
"""Vectors that are longer than so many times the scale's are cut short."""
LEVEL = 0.01
"""Of a false alarm in any cell of a panel."""


def residuals(result: object, ax: Where = None) -> Any:
    """Draw image residuals over the frame of each camera: one by one, or the means of cells where many.

    Means that errors by chance would hardly give (1 percent for all cells together) are coloured.

    Parameters
    ----------
    result
        An adjusted block or collection.
    ax
        Axes, as many as there are cameras (six at most), or a figure to put them in; a new one when None.

    Returns
    -------
    The axes, or an array of them where there are several cameras.

    Raises
    ------
    InputError
        Another number of axes.
    ModuleNotFoundError
        matplotlib is absent (`pip install 'photogram[plots]'`).
    TypeError
        A result without photos and points.
    """
    images = pictured(result).images
    cameras, left_out = largest_cameras(images)
    columns = min(3, len(cameras))
    rows = -(-len(cameras) // columns)
    width = 6.4 if columns == 1 else 4.2 * columns
    shown = images.cameras == cameras[0]
    extent = np.ptp(images.xy[shown], axis=0) if shown.any() else np.ones(2)
    across, up = np.maximum(extent + 2 * ROOM * extent.max(), 1e-12)
    many = np.bincount(images.cameras[np.isin(images.cameras, cameras)]).max(initial=0) > SINGLE
    # Title, scale and labels; where means are drawn, also what they are.
    beside = 1.95 if many else 1.25
    high = rows * (float(np.clip(up / across, 0.3, 1.5)) * (width / columns - 0.75) + beside)
    with panels(ax, rows, columns, width, high) as found:
        for axes, camera in zip(found, cameras, strict=False):
            _field(axes, images, camera, left_out if camera == cameras[-1] else "")
        for unused in found[len(cameras) :]:
            unused.set_visible(False)
    return handed_out(found[: len(cameras)])


def largest_cameras(images: Images, most: int = CAMERAS) -> tuple[list[int], str]:
    """Return the cameras with the most images, in their order, and what is to be said of the others."""
    counts = np.bincount(images.cameras, minlength=len(images.names))
    there = int((counts > 0).sum())
    chosen = np.sort(np.argsort(-counts, kind="stable")[: min(most, there)]).tolist()
    said = f"{len(chosen)} of {there} cameras are drawn, those with the most images" if there > most else ""
    return chosen or [0], said


def frame(axes: Axes, images: Images, edges: Floats, *, scanned: bool = False) -> None:
    """Give axes the frame of a camera: equal scales, room around it, y as the camera counts it.

    Of a scanner they are samples and lines, upwards: so residuals point as they do in its focal plane.
    """
    low, high = edges
    margin = ROOM * float((high - low).max())
    axes.set_aspect("equal", anchor="NW")
    axes.set_xlim(low[0] - margin, high[0] + margin)
    up = (low[1] - margin, high[1] + margin)
    axes.set_ylim(*(up[::-1] if images.down and not scanned else up))
    axes.set_xlabel("sample" if scanned else f"x, {images.unit}")
    axes.set_ylabel("line" if scanned else f"y, {images.unit}")


def _field(axes: Axes, images: Images, camera: int, left_out: str) -> None:
    """Draw the residuals of a camera, and say what was left out."""
    own = images.cameras == camera
    xy, vectors = images.xy[own], images.residuals[own]
    factor, unit = images.shown_as
    if not len(xy):
        return
    longer = int(np.clip(np.sqrt(len(xy) / IN_CELL), 6, CELLS))
    grid = cells(xy, longer)
    scanned = images.of_scanner(camera)
    frame(axes, images, grid.edges, scanned=scanned)
    remark: list[str] = []
    if len(xy) <= SINGLE:
        places, shown, colours = xy, vectors, np.full(len(xy), INK)
    else:
        places, shown, colours, remark = _means(grid, vectors)
    cut = 0
    size = float(np.quantile(np.hypot(*shown.T), 0.9)) if len(shown) else 0.0
    extent = float((grid.edges[1] - grid.edges[0]).max())
    bars = []
    if size > 0:
        scale = 0.7 * extent / longer / size if len(xy) > SINGLE else 0.045 * extent / size
        longest = LONGEST * 0.1 * extent / scale
        lengths = np.hypot(*shown.T)
        cut = int((lengths > longest).sum())
        shown = shown * np.minimum(1.0, longest / np.maximum(lengths, 1e-300))[:, np.newaxis]
        axes.quiver(
            *places.T,
            *(scale * shown).T,
            angles="xy",
            scale_units="xy",
            scale=1.0,
            color=colours,
            width=0.0028,
            headwidth=3.5,
            headlength=4.5,
            zorder=2.0,
        )
        bar = round_length(0.15 * extent / scale * factor)
        bars = [(scale * bar / factor, INK, f"{bar:g} {unit}")]
    axes.plot(*places.T, ".", color=FAINT, markersize=2.0, zorder=1.0)
    rms = np.sqrt((vectors**2).mean(axis=0)) * factor
    name = images.names[camera]
    scale_bars(axes, bars, f"{name}: {len(xy):,} images, rms {rms[0]:.3g}, {rms[1]:.3g} {unit}")
    in_plane = "vectors: x to the right and y up, in the focal plane" if scanned else ""
    note(axes, [*remark, in_plane, f"vectors that are longer and cut short: {cut}" if cut else "", left_out])


def _means(grid: Cells, vectors: Floats) -> tuple[Floats, Floats, Any, list[str]]:
    """Return places, mean vectors and colours of the cells of a frame, and what they are."""
    from photogram.statistics.distributions import critical_chi_square

    means = np.column_stack([grid.means(vectors[:, axis]) for axis in (0, 1)])
    variance = (vectors**2).mean(axis=0)
    filled = np.flatnonzero(grid.counts >= min(FEWEST, int(grid.counts.max())))
    with np.errstate(invalid="ignore", divide="ignore"):
        square = (means[filled] ** 2 * grid.counts[filled, np.newaxis] / variance).sum(axis=1)
    beyond = square > critical_chi_square(LEVEL / len(filled), 2)
    colours = np.where(beyond, MARKED, INK)
    per_cell = _between(grid.counts[filled])
    said = [f"means of cells with {per_cell} images,", f"those with less than {FEWEST} are left out"]
    if beyond.any():
        said.append(f"{int(beyond.sum())} of {len(filled)} are larger than chance gives (coloured)")
    return grid.middles[filled], means[filled], colours, said


def _between(counts: Indices) -> str:
    low, high = int(counts.min()), int(counts.max())
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"
