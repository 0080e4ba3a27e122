"""The plot of variance components."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.show.sketch.declared import Panel
from photogram.show.sketch.marks import Line, Mark, Markers
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, MARKED
from photogram.statistics.components import Component

INCHES_OF_COMPONENT = 0.32
MARGIN = 1.1  # Limits over the extreme values


def components_sketch(components: Sequence[Component]) -> Plot:
    """Plot factors of standard deviations with 95 percent intervals; circles are fixed components."""
    marks: list[Mark] = []
    for place, each in enumerate(components):
        at = np.array([[each.factor_of_sd, place]])
        if each.held:
            marks.append(Markers(at, "o", 6.0, FAINT, "none"))
            continue
        colour = MARKED if each.worth_changing else INK
        ends = np.column_stack([np.sqrt(each.interval), [place, place]])
        marks += [Line(ends, colour), Markers(at, "o", 6.0, colour)]
    known = np.concatenate([mark.places[:, 0] for mark in marks if isinstance(mark, Line | Markers)])
    known = np.append(known[np.isfinite(known) & (known > 0)], 1.0)
    up = (len(components) - 0.5, -0.5)
    limits = np.column_stack([(known.min() / MARGIN, known.max() * MARGIN), up])
    given = Line(np.column_stack([[1.0, 1.0], up]), FAINT, 0.8)
    across = "factor of the given standard deviation, 95 percent; circles: held"
    names = [each.name for each in components]
    panel = Panel(limits, [given, *marks], "", across, up_names=names, log_across=True)
    return Plot(6.4, 1.6 + INCHES_OF_COMPONENT * len(components), [panel])
