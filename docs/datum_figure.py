"""Draw standard ellipses of one network in three datums: docs/datum.svg.

    python docs/datum_figure.py

The network is that of examples/free_network.py, adjusted once.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from views import svg

from photogram.arguments.types import Floats
from photogram.show.style import new_figure, round_length

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from free_network import in_three_datums

FIGURE = Path(__file__).with_name("datum.svg")
TITLES = (
    "minimum constraints:\nphoto {} and one coordinate fixed",
    "inner constraints\nover all points",
    "inner constraints\nover four points (filled)",
)
WIDEST = 0.42
"""Of the largest semi-axis as it is drawn, metres of the plan."""


def ellipses(axes: Axes, places: Floats, covariances: Floats, scale: float = 1.0, **style: object) -> None:
    """Draw standard ellipses (39 percent) of (n, 2, 2) covariances about (n, 2) places, magnified."""
    around = np.linspace(0.0, math.tau, 73)
    circle = np.stack([np.cos(around), np.sin(around)])
    variances, turned = np.linalg.eigh(covariances)
    for place, variance, turn in zip(places, variances, turned, strict=True):
        outline = place[:, np.newaxis] + scale * turn @ (
            np.sqrt(np.maximum(variance, 0.0))[:, np.newaxis] * circle
        )
        axes.plot(*outline, **style)


def draw() -> Figure:
    """Draw the points in plan with their ellipses, and where the photos are."""
    results = in_three_datums()
    figure = new_figure(10.5, 4.2)
    largest = max(np.linalg.eigvalsh(result.point_covariances[:, :2, :2]).max() for result in results) ** 0.5
    scale = WIDEST / largest
    panels = figure.subplots(1, 3, sharex=True, sharey=True)
    for axes, result, title in zip(panels, results, TITLES, strict=True):
        carriers = (
            set(result.datum.points) if len(result.datum.points) < len(result.block.point_ids) else set()
        )
        filled = np.array([name in carriers for name in result.block.point_ids])
        places = result.point_positions[:, :2]
        axes.scatter(*places[~filled].T, s=4, color="0.2")
        axes.scatter(*places[filled].T, s=22, color="#009e73")
        ellipses(axes, places, result.point_covariances[:, :2, :2], scale, color="#0072b2", linewidth=1.0)
        stations = result.photo_positions[:, :2]
        axes.scatter(*stations.T, s=22, marker="^", color="#d55e00")
        axes.set_title(title.format(result.datum.held[0][0]), fontsize=10)
        axes.set(aspect="equal", xlim=(-1.9, 2.1), ylim=(-1.9, 1.9))
        axes.axis("off")
    length = round_length(0.7 * largest)
    panels[0].plot([-1.8, -1.8 + scale * length], [-1.8, -1.8], color="0.2", linewidth=2)
    panels[0].text(-1.8, -1.75, f"{1e6 * length:.0f} um of standard deviation", fontsize=8)
    return figure


def main() -> None:
    """Write the figure."""
    FIGURE.write_text(svg(draw), encoding="utf-8")


if __name__ == "__main__":
    main()
