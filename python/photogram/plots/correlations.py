"""Correlations of the parameters of cameras, as matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from photogram.errors import InputError
from photogram.plots.panels import Where, handed_out, note, panels
from photogram.plots.picture_data import Correlated, pictured
from photogram.show.style import signed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage

CAMERAS = 4
"""That have a panel at most."""
WRITTEN = 14
"""Parameters whose coefficients are written into the matrix at most."""


def correlations(result: object, ax: Where = None) -> Any:
    """Draw the correlations of the estimated parameters of cameras.

    Parameters
    ----------
    result
        An adjusted block or collection.
    ax
        Axes, as many as there are cameras (four at most), or a figure to put them in; a new one when None.

    Returns
    -------
    The axes, or an array of them where there are several cameras.

    Raises
    ------
    InputError
        No camera has two estimated parameters, or there are no covariances; another number of axes.
    ModuleNotFoundError
        matplotlib is absent (`pip install 'photogram[plots]'`).
    TypeError
        A result without photos and points.
    """
    cameras = pictured(result).correlations
    if not cameras:
        raise InputError("there are no correlations to draw: no camera has two estimated parameters")
    shown = cameras[:CAMERAS]
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    side = 2.2 + 0.36 * max(len(each.names) for each in shown)
    with panels(ax, rows, columns, columns * side + 0.9, rows * (side + 0.2)) as found:
        drawn = [_matrix(axes, each) for axes, each in zip(found, shown, strict=False)]
        for unused in found[len(shown) :]:
            unused.set_visible(False)
        figure = found[0].get_figure()
        assert figure is not None
        figure.colorbar(
            drawn[0], ax=found[: len(shown)], label="correlation, -1 to 1", aspect=30, shrink=0.85
        )
        if len(cameras) > len(shown):
            note(found[len(shown) - 1], [f"the first {len(shown)} of {len(cameras)} cameras are drawn"])
    return handed_out(found[: len(shown)])


def _matrix(axes: Axes, each: Correlated) -> AxesImage:
    image = axes.imshow(each.coefficients, cmap=signed(), vmin=-1.0, vmax=1.0)
    axes.set_anchor("NW")
    places = range(len(each.names))
    axes.set_xticks(places, each.names, rotation=90 if max(map(len, each.names)) > 3 else 0)
    axes.set_yticks(places, each.names)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_title(", ".join(part for part in (each.camera, each.remark) if part))
    if len(each.names) <= WRITTEN:
        for i in places:
            for j in places:
                if i == j:
                    continue
                value = float(each.coefficients[i, j])
                text = f"{value:.2f}".replace("0.", ".", 1) if abs(value) < 0.995 else f"{value:.3f}"
                colour = "white" if abs(value) > 0.7 else "black"
                axes.text(j, i, text, ha="center", va="center", fontsize=6.5, color=colour)
    return image
