"""Stellar camera calibration (NOAA Technical Report NOS 55, 1972)."""

from photogram.arguments.annotations import check_arguments
from photogram.stellar import findings, html  # noqa: F401  (verdicts and pages)
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
