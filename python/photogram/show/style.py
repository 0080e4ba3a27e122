"""Style of all plots: colours for colour-blind readers, and letter sizes.

The colours of categories are the ones of Okabe and Ito (2008, "Color Universal Design"). Ordered values use
`cividis` (Nunez, Anderton and Renslow, PLoS ONE 13, 2018), signed ones blue to white to vermilion.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from photogram.extras import need

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLUE = "#0072b2"
VERMILION = "#d55e00"
GREEN = "#009e73"
PURPLE = "#cc79a7"
ORANGE = "#e69f00"
SKY = "#56b4e9"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)  # Colours of categories, in this order
INK, MARKED, FAINT = "#222222", VERMILION, "#8c8c8c"  # Colours of normal, marked and auxiliary elements
SOFT = "#5c5c5c"  # Colour of secondary text: contrast 6.7 to 1 on white; FAINT, for lines, has 3.4
DPI = 120  # Dots per inch of PNG files

SETTINGS: Any = {
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial"],
}


def new_figure(width: float, height: float) -> Figure:
    """Return a figure without a window (inches)."""
    need("matplotlib")
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained", dpi=DPI)


def round_length(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that does not exceed a value.

    1 if the value is not positive.
    """
    if not value > 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))
