"""Plots of adjusted networks: `result.plot.network()` and others."""

from photogram.plots.accessor import Plots
from photogram.show.sketch.plot import Plot

__all__ = ["Plot", "Plots"]
