"""Pictures of adjusted networks; each takes axes of matplotlib and returns them.

`result.plot.network()` is `photogram.plots.network(result)`.
"""

from photogram.plots.accessor import PICTURES, Plots, figures, picture_files
from photogram.plots.correlations import correlations
from photogram.plots.distortion import distortion
from photogram.plots.features import features
from photogram.plots.films import films
from photogram.plots.network import network
from photogram.plots.redundancy import redundancy
from photogram.plots.residuals import residuals
from photogram.plots.tests import tests
from photogram.plots.trajectories import trajectory
from photogram.show.pictures import drawn

__all__ = [
    "PICTURES",
    "Plots",
    "correlations",
    "distortion",
    "drawn",
    "features",
    "figures",
    "films",
    "network",
    "picture_files",
    "redundancy",
    "residuals",
    "tests",
    "trajectory",
]
