"""Distribution of the residuals, components of the error."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.pictures.style import ACCENT, MAIN
from photogram.show.pictures import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.comparator.calibration import Calibration


def residual_histogram(calibration: Calibration) -> Figure:
    """Draw histograms of the final residuals against the normal curve of their standard deviation."""
    from matplotlib.ticker import MaxNLocator

    residuals = np.vstack([fit.residuals.comparator_um for fit in calibration.last_fits])
    figure = new_figure(10.0, 3.9)
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    limit = float(np.abs(residuals).max()) * 1.1 or 1.0
    bins = np.linspace(-limit, limit, _bins(len(residuals)) + 1)
    x = np.linspace(-limit, limit, 301)
    for axis, panel in enumerate(axes):
        own = residuals[:, axis]
        sigma = math.sqrt(float((own**2).mean())) or 1.0
        panel.hist(own, bins=bins.tolist(), color=MAIN, alpha=0.35, edgecolor=MAIN, linewidth=0.8)
        height = len(own) * (bins[1] - bins[0]) / (sigma * math.sqrt(2 * math.pi))
        curve = height * np.exp(-((x / sigma) ** 2) / 2)
        panel.plot(x, curve, color=ACCENT, linewidth=1.8)
        beyond = 100 * float((np.abs(own) > 2 * sigma).mean())
        panel.set_title(
            f"{'xy'[axis]}: {len(own)} residuals, rms {sigma:.3f} µm,\n"
            f"{beyond:.1f} % beyond twice that (normal: 4.6 %)"
        )
        panel.set_xlabel("residual, µm")
    axes[0].yaxis.set_major_locator(MaxNLocator(integer=True))
    axes[0].set_ylabel("number")
    figure.suptitle("Final residuals in the comparator system and the normal curve", fontsize=11)
    return figure


def _bins(count: int) -> int:
    """Return an odd number of bins (so that one is about zero), growing with the root of the count."""
    return 2 * round(math.sqrt(count) * 0.75) + 1


def variance_bars(calibration: Calibration) -> Figure:
    """Draw the components of the error as bars of variance."""
    components = calibration.variance.components_um
    total = components["total"] ** 2
    names = [name for name in components if name != "total"]
    figure = new_figure(8.0, 2.9)
    axes = figure.subplots()
    values = [components[name] ** 2 for name in names]
    bars = axes.barh(names[::-1], values[::-1], color=MAIN, alpha=0.75, height=0.6)
    for bar, name in zip(bars, names[::-1], strict=True):
        share = 100 * components[name] ** 2 / total if total else 0.0
        text = f"{components[name]:.3f} µm, {share:.0f} %"
        end = bar.get_width(), bar.get_y() + bar.get_height() / 2
        axes.annotate(text, end, (4, 0), textcoords="offset points", va="center", fontsize=8)
    axes.set_xlim(0, 1.25 * (max(values) or 1.0))
    axes.set_xlabel("variance, µm²")
    axes.set_title(f"Components of the error: {components['total']:.3f} µm before calibration")
    return figure
