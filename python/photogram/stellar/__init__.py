"""Stellar camera calibration (NOAA Technical Report NOS 55, 1972)."""

from photogram.arguments.annotations import check_arguments
from photogram.stellar.adjustment import calibrate
from photogram.stellar.cameras import BrownCamera, PlateCamera, SkyCamera
from photogram.stellar.options import Options
from photogram.stellar.problem import Axis, Problem, default_parameters
from photogram.stellar.result import Result
from photogram.stellar.sky import Air, Effects, Site, refraction

__all__ = [
    "Air",
    "Axis",
    "BrownCamera",
    "Effects",
    "Options",
    "PlateCamera",
    "Problem",
    "Result",
    "Site",
    "SkyCamera",
    "calibrate",
    "default_parameters",
    "refraction",
]

check_arguments(globals(), set(__all__) - {"Result"})

WAYS = {"findings_of": ("findings",), "page_of": ("page", "night_page")}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""
