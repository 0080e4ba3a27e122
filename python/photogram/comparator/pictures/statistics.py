"""Plots of the residual distribution and the error components."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.pictures.vectors import ACCENT, MAIN
from photogram.show.sketch.marks import Line, Panel, Polygons, Texts, boxes
from photogram.show.sketch.plot import Plot

if TYPE_CHECKING:
    from photogram.comparator import Calibration


def residual_histogram(calibration: Calibration) -> Plot:
    """Draw histograms of the final residuals with normal curves."""
    residuals = np.vstack([fit.residuals.comparator_um for fit in calibration.last_fits])
    limit = float(np.abs(residuals).max()) * 1.1 or 1.0
    bins = 2 * round(math.sqrt(len(residuals)) * 0.75) + 1  # Odd
    edges = np.linspace(-limit, limit, bins + 1)
    counts = [np.histogram(own, edges)[0] for own in residuals.T]
    sigmas = [math.sqrt(float((own**2).mean())) or 1.0 for own in residuals.T]
    scale = len(residuals) * (edges[1] - edges[0]) / math.sqrt(2 * math.pi)
    top = 1.05 * max(*(float(own.max()) for own in counts), *(scale / sigma for sigma in sigmas))
    limits = np.array([[-limit, 0.0], [limit, top]])
    panels = []
    for axis, (own, count, sigma) in enumerate(zip(residuals.T, counts, sigmas, strict=True)):
        x = np.linspace(-limit, limit, 301)
        curve = np.column_stack([x, scale / sigma * np.exp(-((x / sigma) ** 2) / 2)])
        bars = boxes(np.column_stack([edges[:-1], 0 * count]), np.column_stack([edges[1:], count]))
        beyond = 100 * float((np.abs(own) > 2 * sigma).mean())
        title = (
            f"{'xy'[axis]}: {len(own)} residuals, rms {sigma:.3f} µm,\n"
            f"{beyond:.1f} % beyond twice that (normal: 4.6 %)"
        )
        marks = [Polygons(bars, MAIN, 0.35, MAIN, 1.0, 0.8), Line(curve, ACCENT, 1.8)]
        panels.append(Panel(limits, marks, title, "residual, µm", "" if axis else "number"))
    title = "Final residuals in the comparator system and the normal curve"
    return Plot(10.0, 3.9, panels, 2, title=title)


def variance_bars(calibration: Calibration) -> Plot:
    """Draw the components of the error as bars of variance."""
    components = calibration.variance.components_um
    total = components["total"] ** 2
    names = [name for name in components if name != "total"][::-1]
    values = np.array([components[name] ** 2 for name in names])
    right, places = 1.25 * (float(values.max()) or 1.0), np.arange(len(names), dtype=float)
    shares = 100 * values / total if total else 0 * values
    every = zip(names, shares.tolist(), strict=True)
    texts = [f"{components[name]:.3f} µm, {share:.0f} %" for name, share in every]
    bars = boxes(np.column_stack([0 * values, places - 0.3]), np.column_stack([values, places + 0.3]))
    marks = [
        Polygons(bars, MAIN, 0.75, MAIN, 0.0, 0.0),
        Texts(np.column_stack([values + 0.01 * right, places]), texts, 8.0),
    ]
    title = f"Components of the error: {components['total']:.3f} µm before calibration"
    limits = np.array([[0.0, -0.5], [right, len(names) - 0.5]])
    return Plot(8.0, 2.9, [Panel(limits, marks, title, "variance, µm²", up_names=names)])
