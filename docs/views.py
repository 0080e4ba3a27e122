"""Drawings of directions in space, for the figures of the documentation."""

from __future__ import annotations

from io import StringIO
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

BLUE, RED, GREEN, GREY, LIGHT = "#0072b2", "#d55e00", "#009e73", "0.45", "0.75"
LETTER = 5.0
"""Points that a letter takes."""


class View:
    """An orthographic view of a right-handed space."""

    def __init__(self, axes: Any, turn: float, tilt: float, box: tuple[float, float, float, float]) -> None:
        (s, c), (st, ct) = ((np.sin(a), np.cos(a)) for a in np.radians([turn, tilt]))
        self.axes, self.rows = axes, np.array([[c, s, 0.0], [-s * st, c * st, ct]])
        axes.set(aspect="equal", xlim=box[:2], ylim=box[2:])
        axes.axis("off")

    def line(self, points: Floats, **style: Any) -> None:
        """Draw a line through points in space."""
        self.axes.plot(*(self.rows @ np.asarray(points).T), **{"color": GREY, "linewidth": 1.0, **style})

    def arrow(self, start: Floats, end: Floats, label: str, colour: str, out: float = 1.17) -> None:
        """Draw an arrow with its name beyond the point."""
        a, b = self.rows @ start, self.rows @ end
        style = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
        self.axes.annotate("", b, a, arrowprops=style)
        self.text(start + out * (end - start), label, colour, along=b - a)

    def text(
        self,
        place: Floats,
        label: str,
        colour: str = "black",
        along: Floats | tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Write at a place in space; beside what comes along a direction of the page to this place."""
        across, up = np.asarray(along) / max(float(np.hypot(*along)), 1e-9)
        beside = 0.5 * LETTER * (len(label) - 1) * across, 3.0 * up
        self.axes.annotate(
            label,
            self.rows @ place,
            beside,
            textcoords="offset points",
            color=colour,
            ha="center",
            va="center",
            fontsize=9,
            # Lines end at the letters. A stroke around these would do so, too, but make outlines of them.
            bbox={"boxstyle": "square,pad=0.05", "facecolor": "white", "edgecolor": "none"},
            zorder=5,
        )

    def arc(
        self, start: Floats, end: Floats, label: str, colour: str, radius: float, out: float = 1.25
    ) -> None:
        """Draw the arc between two directions, with a point at its end."""
        a, b = (v / np.linalg.norm(v) for v in (start, end))
        angle = np.arccos(np.clip(a @ b, -1.0, 1.0))
        t = np.linspace(0.0, 1.0, 40)[:, None]
        points = radius * (np.sin((1 - t) * angle) * a + np.sin(t * angle) * b) / np.sin(angle)
        self.line(points[:-2], color=colour, linewidth=1.3)
        tip, before = self.rows @ points[-1], self.rows @ points[-4]
        style = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.3, "shrinkA": 0, "shrinkB": 0}
        self.axes.annotate("", tip, before, arrowprops=style)
        self.text(out * points[20], label, colour, along=self.rows @ points[20])


def circle(u: Floats, v: Floats) -> Floats:
    """Return the circle through two directions at right angles."""
    t = np.linspace(0.0, 2.0 * np.pi, 181)[:, None]
    return np.cos(t) * u + np.sin(t) * v


def svg(draw: Callable[[], Figure]) -> str:
    """Return a drawing as an SVG document, the same in every run."""
    with mpl.rc_context({"svg.hashsalt": "photogram", "svg.fonttype": "none", "font.family": "sans-serif"}):
        text = StringIO()
        draw().savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"
