"""The plain form of a calibration: options in TOML, stars and images in CSV (`docs/stellar-camera.md`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.io.rows import Row, read_rows
from photogram.io.toml import Document, Table, read_document
from photogram.messages import listed
from photogram.show.angles import ARCSEC
from photogram.stellar.cameras import PlateCamera
from photogram.stellar.catalogue import star_key
from photogram.stellar.landmarks import HOUR, landmark
from photogram.stellar.options import Options
from photogram.stellar.parameters import GRAD, GROUPS, INDEX, NAMES, UNITS
from photogram.stellar.places import sidereal_time
from photogram.stellar.problem import Axis, Problem, default_parameters, rejected
from photogram.stellar.sky import Site
from photogram.stellar.tomlfile import effects, pole_arcsec, site

_OPTIONS: dict[str, Callable[[Table, str], Any]] = {
    "common_scale": Table.switch,
    "refraction": Table.switch,
    "minimum_stars": Table.words,
    "pre_run": Table.switch,
    "curves": Table.switch,
    "plate_list": Table.switch,
    "max_iterations_minimum": Table.count,
    "max_iterations": Table.count,
    "mean_error": Table.number,
    "histogram": Table.switch,
    "tolerance": Table.number,
    "refraction_tolerance_arcsec": Table.number,
    "distortion_tolerance": Table.number,
    "movement_factor": Table.number,
    "movement_time": Table.number,
    "crossover": Table.number,
    "interval": Table.number,
    "extent": Table.number,
    "comparator_angle_deg": Table.number,
    "distortion_first": Table.number,
    "as_published": Table.switch,
}
_STAR_WEIGHT = ("weight_ra", "weight_dec", "weight_cross")
_IMAGE_WEIGHT = ("weight_xx", "weight_yy", "weight_xy")
_TABLES = {
    "labels": None,
    "station": None,
    "places": ("diurnal_aberration", "refraction", "dut1_s"),
    "reference": None,
    "pole": ("x_arcsec", "y_arcsec"),
    "camera": None,
    "weights": None,
    "axis": ("azimuth_deg", "zenith_distance_deg", "x_m", "y_m", "weight", "orientation"),
    "options": None,
    "stars": ("file", "weight"),
    "images": ("file", "weight", "first_post", "first_event", "time_corrections_rad"),
    "reject": ("stars", "points"),
}


def read_plain(path: Path) -> Problem:
    """Read a calibration in plain form.

    Raises InputError: a file that cannot be read, and what cannot be used, with the file, and the record of a
    CSV file.

    Parameters
    ----------
    path
        The TOML file; it names the CSV files of stars and images, relative to itself.
    """
    document = read_document(path, _TABLES)
    try:
        return _problem(document)
    except InputError as error:
        raise error if error.file else InputError(error.message, file=path) from None


def inputs(path: Path) -> list[Path]:
    """Return the files that a calibration is read from: results must not replace them."""
    document = read_document(path, _TABLES)
    files = (("stars", "file"), ("images", "file"), ("camera", "prior"))
    named = [document.optional(table) for table, _ in files]
    return [path, *(table.path(key) for table, (_, key) in zip(named, files, strict=True) if key in table)]


def _problem(document: Document) -> Problem:
    camera = document.table("camera")
    known = PlateCamera.read(camera.path("prior")) if "prior" in camera else None
    unit = camera.positive("prior_unit_m") if "prior_unit_m" in camera else None
    initial, fixed = _camera(camera, known)
    stars, images = document.table("stars"), document.table("images")
    star_rows = read_rows(stars.path("file"), ("star", "ra_rad", "dec_rad"))
    image_rows = read_rows(images.path("file"), ("star", "point", "x_m", "y_m"))
    station = replace(site(document.table("station")), effects=effects(document.optional("places")))
    ids = tuple(row.cells.get("star", "") for row in star_rows)
    place: dict[str, int] = {}
    for index, row in enumerate(star_rows):
        if place.setdefault(star_key(ids[index]), index) != index:
            raise row.place.error(f"star {ids[index]} is listed twice")
        if not _is_landmark(row) and abs(row.required("dec_rad")) > math.pi / 2:
            raise row.place.error("dec_rad is beyond the pole: declinations are between -pi/2 and pi/2")
    for row in image_rows:
        name = row.cells.get("star", "")
        if star_key(name) not in place:
            raise row.place.error(f"ERROR 1: star {name} is not listed")
    star_weight, image_weight = _common_weight(stars), _common_weight(images)
    places, weights = _stars(star_rows, star_weight, station)
    options = _options(document)
    landmarks = {star_key(ids[i]) for i, row in enumerate(star_rows) if _is_landmark(row)}
    if landmarks and options.refraction:
        raise stars.error(
            "file", "has observed directions of landmarks: no refraction is estimated with them"
        )
    dut1 = document.optional("places").number("dut1_s", 0.0, low=-1, high=1)
    groups = _Groups(images, landmarks, partial(sidereal_time, station, dut1=dut1))
    problem = Problem(
        site=station,
        star_ids=ids,
        star_names=tuple(row.cells.get("name") or row.cells.get("star", "") for row in star_rows),
        star_places=places,
        star_weights=weights,
        image_points=tuple(row.cells.get("point", "") for row in image_rows),
        image_stars=np.array([place[star_key(row.cells.get("star", ""))] for row in image_rows], np.int64),
        image_groups=np.array([groups.of(row) for row in image_rows], np.int64),
        image_xy=_pairs(image_rows, "x_m", "y_m"),
        image_weights=_matrices([_weight(row, image_weight, _IMAGE_WEIGHT) for row in image_rows]),
        image_times=np.array([groups.time(row) for row in image_rows]),
        initial=initial,
        parameter_weights=_parameter_weights(document.optional("weights")),
        fixed=fixed,
        axis=_axis(document.table("axis")) if "axis" in document else None,
        options=options,
        labels={name: document.table("labels").word(name) for name in document.optional("labels").values},
    )
    if known is not None:
        problem = known.as_prior(problem, unit)
    reject = document.optional("reject")
    return rejected(problem, set(reject.words("stars", ())), set(reject.words("points", ())))


def _camera(table: Table, prior: PlateCamera | None) -> tuple[Floats, Bools]:
    """Read initial values: angles in grads, all else in the units of the parameters."""
    fixed = np.zeros(len(NAMES), bool)
    for name in table.words("fixed", ()):
        fixed[_index(table, name)] = True
    values = {name: name for name in table.values if name not in ("prior", "prior_unit_m", "fixed")}
    for angle in ("alpha", "omega", "kappa"):
        if values.pop(angle, None):
            for group in GROUPS:
                values.setdefault(f"{angle}_{group}", angle)
    own = None if prior is None else float(prior.values[INDEX["cx"] - 9])
    parameters = default_parameters(table.positive("cx", own))
    for name, key in values.items():
        index = _index(table, name)
        parameters[index] = table.number(key) * (GRAD if UNITS[name] == "rad" else 1.0)
    return parameters, fixed


def _index(table: Table, name: str) -> int:
    if name not in INDEX:
        raise InputError(
            f"[{table.name}] there is no parameter {name!r}; there are {', '.join(NAMES)}", file=table.file
        )
    return INDEX[name]


def _parameter_weights(table: Table) -> Floats:
    """Read weights, angles in radians: `name = w`, or `pairs = [[name, name, w], ...]`."""
    weights = np.zeros((len(NAMES), len(NAMES)))
    for first, second, value in table.rows("pairs", (str, str, float)):
        row, column = _index(table, first), _index(table, second)
        weights[row, column] = weights[column, row] = value
    for name in table.values:
        if name != "pairs":
            weights[_index(table, name), _index(table, name)] = table.number(name, low=0)
    return weights


def _common_weight(table: Table) -> list[float] | None:
    return table.numbers("weight", 3) if "weight" in table else None


def _pairs(rows: list[Row], first: str, second: str) -> Floats:
    return np.array([[row.required(first), row.required(second)] for row in rows]).reshape(-1, 2)


def _matrices(weights: list[Floats]) -> Floats:
    return np.array(weights).reshape(-1, 2, 2)


def _weight(row: Row, common: list[float] | None, names: tuple[str, str, str]) -> Floats:
    first, second, cross = common if common is not None else [row.number(name) or 0.0 for name in names]
    return np.array([[first, cross], [cross, second]])


def _is_landmark(row: Row) -> bool:
    """Whether a row has a terrestrial direction in the place of right ascension and declination."""
    return bool(row.cells.get("azimuth_north_deg"))


def _stars(rows: list[Row], common: list[float] | None, station: Site) -> tuple[Floats, Floats]:
    """Return (S, 2) places and (S, 2, 2) weights of stars and of landmarks among them."""
    found = []
    for row in rows:
        weight = _star_weight(row, common)
        if not _is_landmark(row):
            found.append((np.array([row.required("ra_rad"), row.required("dec_rad")]), weight))
            continue
        azimuth, elevation = (
            math.radians(row.required(f"{name}_deg")) for name in ("azimuth_north", "elevation")
        )
        try:
            found.append(landmark(station, azimuth, elevation, weight))
        except InputError as error:
            raise row.place.error(error.message) from None
    places, weights = ([each[k] for each in found] for k in range(2))
    return np.array(places).reshape(-1, 2), _matrices(weights)


def _star_weight(row: Row, common: list[float] | None) -> Floats:
    if row.cells.get("unknown", "") in ("1", "true", "yes"):
        return np.zeros((2, 2))
    return _weight(row, common, _STAR_WEIGHT)


class _Groups:
    """How images belong to groups, and what is added to their times."""

    def __init__(self, table: Table, landmarks: set[str], sidereal: Callable[[str], float]) -> None:
        self.landmarks, self.sidereal = landmarks, sidereal
        self.post, self.event = table.count("first_post", 500), table.count("first_event", 900)
        self.corrections = table.numbers("time_corrections_rad", 3, [0.0, 0.0, 0.0])

    def of(self, row: Row) -> int:
        """Take the column `orientation`, else the number of the point as in the deck."""
        name, point = row.cells.get("orientation", ""), row.cells.get("point", "")
        if name:
            if name not in GROUPS:
                raise row.place.error(f"orientation {name!r} is not one of {', '.join(GROUPS)}")
            return GROUPS.index(name)
        digits = point.removeprefix("-")
        if not (digits.isascii() and digits.isdigit()):
            raise row.place.error(f"point {point!r} is not a number: name its orientation")
        # The trail is the last three digits.
        trail = int(digits[-3:])
        return 0 if trail < self.post else 1 if trail < self.event else 2

    def time(self, row: Row) -> float:
        """Return the sidereal time of an image."""
        if star_key(row.cells.get("star", "")) in self.landmarks:
            return HOUR
        if utc := row.cells.get("utc", ""):
            try:
                time = self.sidereal(utc)
            except InputError as error:
                raise row.place.error(error.message) from None
        else:
            time = row.required("sidereal_time_rad")
        return time + self.corrections[self.of(row)]


def _axis(table: Table) -> Axis:
    xx, yy, xy = table.numbers("weight", 3)
    group = table.text("orientation", "event")
    if group not in GROUPS:
        raise table.error("orientation", f"{group!r} is not one of {', '.join(GROUPS)}")
    return Axis(
        azimuth=math.radians(table.number("azimuth_deg", low=-360, high=360)),
        zenith_distance=math.radians(table.number("zenith_distance_deg", low=-90, high=90)),
        xy=np.array([table.number("x_m", 0.0), table.number("y_m", 0.0)]),
        weight=np.array([[xx, xy], [xy, yy]]),
        group=GROUPS.index(group),
    )


def _options(document: Document) -> Options:
    table = document.optional("options")
    unknown = sorted(set(table.values) - set(_OPTIONS))
    if unknown:
        raise InputError(f"there is no option {listed(unknown)}", file=table.file)
    values = {name: _OPTIONS[name](table, name) for name in table.values}
    if "refraction_tolerance_arcsec" in values:
        values["refraction_tolerance"] = values.pop("refraction_tolerance_arcsec") * ARCSEC
    if "comparator_angle_deg" in values:
        values["comparator_angle"] = math.radians(values.pop("comparator_angle_deg"))
    pole = document.optional("pole")
    return Options(
        reference=site(document.table("reference")) if "reference" in document else None,
        pole=(pole_arcsec(pole, "x_arcsec") * ARCSEC, pole_arcsec(pole, "y_arcsec") * ARCSEC),
        **values,
    )
