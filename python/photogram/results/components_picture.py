"""The picture of variance components (needs `pip install 'photogram[plots]'`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram.plots.placed import placed
from photogram.results.components import VarianceComponents
from photogram.show.axes import Where
from photogram.show.methods import axes_of
from photogram.show.sketch.declared import Panel, Sketch
from photogram.show.sketch.marks import Line, Mark, Markers
from photogram.show.sketch.on_axes import on_axes
from photogram.show.style import FAINT, INK, MARKED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INCHES = 0.32
"""Of height for each component."""
ROOM = 1.1
"""By what limits are beyond the values."""


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
    axes: Axes = placed(components_sketch(found), path, ax)
    return axes


def components_sketch(found: VarianceComponents) -> Sketch:
    """Return the picture of components; see :func:`draw_components`."""
    every = found.components
    marks: list[Mark] = []
    for place, each in enumerate(every):
        at = np.array([[each.factor_of_sd, place]])
        if each.held:
            marks.append(Markers(at, "o", 6.0, FAINT, "none"))
            continue
        colour = MARKED if each.worth_changing else INK
        ends = np.column_stack([np.sqrt(each.interval), [place, place]])
        marks += [Line(ends, colour), Markers(at, "o", 6.0, colour)]
    known = np.concatenate([mark.places[:, 0] for mark in marks if isinstance(mark, Line | Markers)])
    known = np.append(known[np.isfinite(known) & (known > 0)], 1.0)
    up = (len(every) - 0.5, -0.5)
    limits = np.column_stack([(known.min() / ROOM, known.max() * ROOM), up])
    given = Line(np.column_stack([[1.0, 1.0], up]), FAINT, 0.8)
    across = "factor of the given standard deviation, 95 percent; circles: held"
    names = [each.name for each in every]
    panel = Panel(limits, [given, *marks], "", across, up_names=names, log_across=True)
    return Sketch(6.4, 1.6 + INCHES * len(every), [panel])


@axes_of.register(VarianceComponents)
def _components(found: VarianceComponents, ax: Where = None) -> Axes:
    axes: Axes = on_axes(components_sketch(found), ax)
    return axes
