"""The effect of an undetected error on the points of a network in plan."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.plots.network import View, usual, vectors
from photogram.plots.picture_data import Moved
from photogram.plots.selection import thinned
from photogram.show.sketch.marks import Mark, Markers, Shades
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, PURPLE
from photogram.words import phrase

MAX_PHOTOS = 300
CENTRAL = 0.9  # Part of the larger changes that defines the colours
LONGEST = 4.0  # Usual changes; larger ones are without arrows


def undetected(result: Any, *, error: int | None = None) -> Plot:
    """Plot what an undetected error would change: points in plan, and their changes.

    Points are coloured if a coordinate changes by more standard deviations than the verdict permits. Arrows
    are changes by an error of the size of the minimal detectable bias, or of a plausible size if an error of
    any size remains undetected. The points or photos of an erroneous observation are marked.

    Parameters
    ----------
    error
        Row of :meth:`~photogram.Result.external_reliability`; None: the error with the worst effect.

    Raises
    ------
    InputError
        If the effect of the error was not computed, because it is small, or the network is not tested.
    """
    drawn = result._plot_data()
    moved = drawn.moved(error)
    if moved is None:
        raise InputError(phrase("plot.undetected"))
    view = View(drawn.plan)
    photos, _ = thinned("photos", np.arange(len(view.photos)), MAX_PHOTOS)
    marks, shades = _points(moved, view.points[moved.points])
    marks.append(Markers(view.photos[photos], "+", 4.0, FAINT, edge=0.6, label="photo"))
    size = usual(moved.changes)
    short = np.linalg.norm(moved.changes, axis=1) <= LONGEST * size
    rows, changes = moved.points[short], moved.changes[short]
    arrows, bars, _ = vectors(view, rows, changes, size, "change", "changes of points by the error")
    marks += arrows
    control = view.points[drawn.plan.kinds == "control"]
    if len(control):
        marks.append(Markers(control, "^", 5.0, INK, "white", 0.8, label="control point", layer=5.0))
    if len(moved.suspects):
        at, label = view.flat(moved.suspects), "observation with the error"
        marks.append(Markers(at, "s", 11.0, PURPLE, "none", 1.6, label=label, layer=7.0))
    count, every = len(moved.points), moved.several
    notes = [
        moved.sentence,
        f"{count:,} of {every:,} points are drawn" if count < every else "",
        "" if short.all() else f"{np.count_nonzero(~short):,} larger changes are drawn without arrows",
    ]
    return view.plot(marks, title="Effect of an undetected error", notes=notes, bars=bars, shades=shades)


def _points(moved: Moved, places: Floats) -> tuple[list[Mark], Shades | None]:
    """Return points, coloured if they change beyond the limit, and the colours."""
    far = moved.ratios > moved.limit
    label = f"change below {moved.limit:g} sd ({np.count_nonzero(~far):,})"
    marks: list[Mark] = [Markers(places[~far], "o", 2.5, FAINT, label=label, layer=6.2)]
    if not far.any():
        return marks, None
    # The point with the error often changes by far more than all others.
    high = max(float(np.quantile(moved.ratios[far], CENTRAL)), 2.0 * moved.limit)
    shades = Shades(moved.limit, high, "change, standard deviations", log=True)
    ratios = moved.ratios[far]
    marks.append(Markers(places[far], "o", 5.5, values=ratios, shades=shades, rising=True, layer=6.5))
    return marks, shades
