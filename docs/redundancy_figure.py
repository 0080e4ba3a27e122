"""Draw how much of an error shows, by the number of rays of a point: docs/redundancy.svg.

    python docs/redundancy_figure.py

The block is a simulated strip of sixteen photos with 80 percent overlap.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from views import BLUE, LIGHT, svg

from photogram import adjust, simulate
from photogram.show.style import new_figure
from photogram.statistics import lambda0

FIGURE = Path(__file__).with_name("redundancy.svg")
RAYS = (2, 3, 4, 5)


@cache
def shares() -> dict[int, np.ndarray]:
    """Return median redundancy numbers of x (along the flight) and y of points, by their number of rays."""
    block = simulate(
        strips=1, photos_per_strip=16, forward_overlap=0.8, points_per_photo=60, position_sd=0.02, seed=3
    ).block
    result = adjust(block)
    rays = np.bincount(block.image_points)[block.image_points]
    return {count: np.median(result.redundancy[rays == count], axis=0) for count in RAYS}


def rays() -> list[str]:
    """Return rows with the shares, the minimal detectable bias and its effect."""
    root = np.sqrt(lambda0(0.001, 0.80))
    lines = [f"{'rays':>4}{'':>4}{'residual':>10}{'unknowns':>10}{'detectable':>12}{'largest effect':>16}"]
    for count, both in shares().items():
        for axis, r in zip("xy", both, strict=True):
            detectable = f"{root / np.sqrt(r):.1f} sd" if r >= 0.01 else "never"
            effect = f"{root * np.sqrt((1 - r) / r):.1f} sd" if r >= 0.01 else "unlimited"
            lines.append(
                f"{count:>4}{axis:>4}{100 * r:>9.0f}%{100 * (1 - r):>9.0f}%{detectable:>12}{effect:>16}"
            )
    return lines


def draw() -> Figure:
    """Draw the share of an error in its residual, one bar per number of rays and axis."""
    figure = new_figure(8.0, 3.0)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, axis, title in zip(
        panels, (0, 1), ("error in x, along the base", "error in y, across the base"), strict=True
    ):
        shown = np.array([both[axis] for both in shares().values()])
        axes.barh(np.arange(len(RAYS)), shown, color=BLUE, label="appears in its residual")
        axes.barh(
            np.arange(len(RAYS)), 1 - shown, left=shown, color=LIGHT, label="changes the unknowns, undetected"
        )
        axes.set_title(title, fontsize=10, loc="left")
        axes.set(xlim=(0, 1), xticks=(0, 0.5, 1), xticklabels=("0", "half", "all"))
        axes.set_yticks(np.arange(len(RAYS)), [f"{count} rays" for count in RAYS])
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.tick_params(left=False)
    panels[0].invert_yaxis()
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False, fontsize=9
    )
    return figure


BLOCKS = {"rays": rays}


if __name__ == "__main__":
    FIGURE.write_text(svg(draw), encoding="utf-8")
