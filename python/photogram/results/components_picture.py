"""The picture of variance components (needs `pip install 'photogram[plots]'`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram.io.writing import write_whole
from photogram.results.components import VarianceComponents
from photogram.show.pictures import drawn, new_figure
from photogram.show.style import FAINT, INK, MARKED, in_style
from photogram.show.ways import picture_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_components"]

INCHES = 0.32
"""Of height for each component."""


def draw_components(found: VarianceComponents, path: Path) -> None:
    """Write the picture of components with their intervals, in the format that the name of the file asks for.

    Raises
    ------
    InputError
        A suffix that names no format.
    """
    write_whole({path: drawn(figure_of_components(found), path)})


@picture_of.register(VarianceComponents)
def _picture(found: VarianceComponents) -> bytes:
    """Return the picture (PNG)."""
    return drawn(figure_of_components(found))


@in_style
def figure_of_components(found: VarianceComponents) -> Figure:
    """Draw factors of standard deviations with 95 percent intervals, held ones as circles."""
    from matplotlib.ticker import LogLocator, NullFormatter  # takes long to import

    figure = new_figure(6.4, 1.6 + INCHES * len(found.components))
    axes = figure.add_subplot()
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
    return figure
