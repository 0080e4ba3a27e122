"""Draw what the adjustment of examples/line_scanner.py moves its trajectory by: docs/moving.svg.

python docs/moving_figure.py
"""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib.figure import Figure
from views import svg

from photogram.show.style import new_figure

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from line_scanner import measured

from photogram import adjust

FIGURE = Path(__file__).with_name("moving.svg")


def draw() -> Figure:
    """Draw corrections of positions and of rotations, with their standard deviations."""
    figure = new_figure(9.0, 3.4)
    adjust(measured()[0]).plot.trajectory().on(figure)
    return figure


def main() -> None:
    """Write the figure."""
    FIGURE.write_text(svg(draw), encoding="utf-8")


if __name__ == "__main__":
    main()
