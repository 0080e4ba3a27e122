"""What the pictures of all programs share; matplotlib is an extra (`pip install 'photogram[plots]'`)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from photogram.show.style import need_matplotlib

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 120  # Dots per inch of PNG files


def new_figure(width: float, height: float) -> Figure:
    """Return a figure that belongs to no window (inches)."""
    need_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # takes long to import
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained", dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


def round_length(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above a value.

    For a value that is not positive, which has none, it is 1.
    """
    if not value > 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))
