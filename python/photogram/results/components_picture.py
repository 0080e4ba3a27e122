"""The picture of variance components (needs `pip install 'photogram[plots]'`)."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram.plots.placed import placed
from photogram.results.components import VarianceComponents
from photogram.show.axes import Where, figure_of, panels
from photogram.show.methods import axes_of
from photogram.show.style import FAINT, INK, MARKED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INCHES = 0.32
"""Of height for each component."""


def draw_components(found: VarianceComponents, path: Path | None = None, ax: Where = None) -> Axes:
    """Draw factors of standard deviations with 95 percent intervals, held ones as circles.

    Parameters
    ----------
    found
        Variance components.
    path
        Of a file for the picture, in the format that its suffix names; None: none is written.
    ax
        Axes, or a figure to put them in; a new figure when None.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError
        A suffix that names no format.
    """
    return placed(partial(_components, found), path, ax)


def figure_of_components(found: VarianceComponents) -> Figure:
    """Return the picture as a figure that belongs to no window."""
    return figure_of(partial(_components, found))


@axes_of.register(VarianceComponents)
def _components(found: VarianceComponents, ax: Where = None) -> Axes:
    from matplotlib.ticker import LogLocator, NullFormatter  # takes long to import

    with panels(ax, 1, 1, 6.4, 1.6 + INCHES * len(found.components)) as [axes]:
        for place, each in enumerate(found.components):
            color = MARKED if each.worth_changing else INK
            if each.held:
                axes.plot(each.factor_of_sd, place, "o", color=FAINT, fillstyle="none")
                continue
            axes.plot(np.sqrt(each.interval), [place, place], color=color)
            axes.plot(each.factor_of_sd, place, "o", color=color)
        axes.axvline(1.0, color=FAINT, linewidth=0.8)
        axes.set_yticks(range(len(found.components)), [each.name for each in found.components])
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel("factor of the given standard deviation, 95 percent; circles: held")
        axes.invert_yaxis()
    return axes
