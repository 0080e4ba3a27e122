"""Stellar camera calibration with plates (NOAA Technical Report NOS 55, 1972) or digital exposures."""

from photogram.arguments.annotations import attach_checked

__getattr__, __dir__, __all__ = attach_checked(
    __name__,
    __file__,
    given={
        "Air",
        "Axis",
        "BrownCamera",
        "Catalogue",
        "Earth",
        "Effects",
        "Exposure",
        "Night",
        "Options",
        "PlateCamera",
        "Problem",
        "Site",
        "SkyCamera",
    },
)
