"""Stellar camera calibration (NOAA Technical Report NOS 55, 1972), by plates and by digital exposures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.arguments.annotations import check_arguments
from photogram.on_demand import on_demand
from photogram.stellar.adjustment import calibrate
from photogram.stellar.cameras import BrownCamera, PlateCamera, SkyCamera
from photogram.stellar.options import Options
from photogram.stellar.problem import Axis, Problem, default_parameters
from photogram.stellar.result import Result
from photogram.stellar.sky import Air, Effects, Site, refraction

if TYPE_CHECKING:
    from photogram.show.angles import ARCSEC
    from photogram.stellar.camera_yaml import read_yaml, to_yaml
    from photogram.stellar.cameras import camera_document
    from photogram.stellar.catalogue import Catalogue
    from photogram.stellar.deck import read_deck
    from photogram.stellar.landmarks import landmark
    from photogram.stellar.lenses import LENSES
    from photogram.stellar.night_calibration import calibrate_night
    from photogram.stellar.night_file import read_night
    from photogram.stellar.night_report import report
    from photogram.stellar.night_result import CalibratedNight, Night
    from photogram.stellar.parameters import GRAD, INDEX, NAMES, UNITS
    from photogram.stellar.places import Earth, apparent_places, sidereal_time
    from photogram.stellar.plain import read_plain
    from photogram.stellar.pointing import attitude_of
    from photogram.stellar.sky_calibration import Exposure, calibrate_exposures, project_sky

__all__ = [
    "ARCSEC",
    "GRAD",
    "INDEX",
    "LENSES",
    "NAMES",
    "UNITS",
    "Air",
    "Axis",
    "BrownCamera",
    "CalibratedNight",
    "Catalogue",
    "Earth",
    "Effects",
    "Exposure",
    "Night",
    "Options",
    "PlateCamera",
    "Problem",
    "Result",
    "Site",
    "SkyCamera",
    "apparent_places",
    "attitude_of",
    "calibrate",
    "calibrate_exposures",
    "calibrate_night",
    "camera_document",
    "default_parameters",
    "landmark",
    "project_sky",
    "read_deck",
    "read_night",
    "read_plain",
    "read_yaml",
    "refraction",
    "report",
    "sidereal_time",
    "to_yaml",
]

_HOMES = {
    "apparent_places": "places",
    "ARCSEC": "sky",
    "attitude_of": "pointing",
    "calibrate_exposures": "sky_calibration",
    "calibrate_night": "night_calibration",
    "CalibratedNight": "night_result",
    "camera_document": "cameras",
    "Catalogue": "catalogue",
    "Earth": "places",
    "Exposure": "sky_calibration",
    "GRAD": "parameters",
    "INDEX": "parameters",
    "landmark": "landmarks",
    "LENSES": "lenses",
    "NAMES": "parameters",
    "Night": "night_result",
    "project_sky": "sky_calibration",
    "read_deck": "deck",
    "read_night": "night_file",
    "read_plain": "plain",
    "read_yaml": "camera_yaml",
    "report": "night_report",
    "sidereal_time": "places",
    "to_yaml": "camera_yaml",
    "UNITS": "parameters",
}
"""The module of each name, loaded when it is first asked for: what nights and files need, plates do not."""

check_arguments(globals(), set(__all__) - {"Result", *_HOMES})

WAYS = {"findings_of": ("findings",), "page_of": ("page", "night_page")}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__ = on_demand(
    __name__,
    _HOMES,
    check_arguments,
    unchecked={"ARCSEC", "CalibratedNight", "GRAD", "INDEX", "LENSES", "NAMES", "UNITS"},
)
