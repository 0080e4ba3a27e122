"""The plain form of a calibration: options in TOML, stars and images in CSV (`docs/stellar-camera.md`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.angles import ARCSEC
from photogram.errors import InputError
from photogram.messages import listed
from photogram.rows import Row, read_rows
from photogram.stellar.cameras import PlateCamera
from photogram.stellar.options import Options
from photogram.stellar.parameters import GRAD, GROUPS, INDEX, NAMES, UNITS
from photogram.stellar.problem import Axis, Problem, default_parameters
from photogram.stellar.rejection import rejected
from photogram.stellar.tomlfile import read_document, site, usable

__all__ = ["inputs", "read_plain"]

Floats = NDArray[np.float64]


def _switch(value: Any) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{value!r} is neither true nor false")
    return value


_OPTIONS: dict[str, Callable[[Any], Any]] = {
    "common_scale": _switch,
    "refraction": _switch,
    "minimum_stars": lambda value: tuple(str(star) for star in value),
    "pre_run": _switch,
    "curves": _switch,
    "plate_list": _switch,
    "max_iterations_minimum": int,
    "max_iterations": int,
    "mean_error": float,
    "histogram": _switch,
    "tolerance": float,
    "refraction_tolerance_arcsec": float,
    "distortion_tolerance": float,
    "movement_factor": float,
    "movement_time": float,
    "crossover": float,
    "interval": float,
    "extent": float,
    "comparator_angle_deg": float,
    "distortion_first": float,
    "as_published": _switch,
}
_STAR_WEIGHT = ("weight_ra", "weight_dec", "weight_cross")
_IMAGE_WEIGHT = ("weight_xx", "weight_yy", "weight_xy")
_TABLES = {
    "labels": None,
    "station": None,
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

    Parameters
    ----------
    path
        The TOML file; it names the CSV files of stars and images, relative to itself.

    Raises
    ------
    InputError
        A file that cannot be read, and what cannot be used, with the file, and the record of a CSV file.
    """
    document = read_document(path, _TABLES)
    with usable(path):
        return _problem(document, path)


def inputs(path: Path) -> list[Path]:
    """Return the files that a calibration is read from: results must not replace them."""
    document = read_document(path, _TABLES)
    files = (("stars", "file"), ("images", "file"), ("camera", "prior"))
    named = [document.get(table, {}).get(key) for table, key in files]
    return [path, *(path.parent / name for name in named if isinstance(name, str))]


def _problem(document: dict[str, Any], path: Path) -> Problem:
    camera = dict(document["camera"])
    prior, unit = camera.pop("prior", None), camera.pop("prior_unit_m", None)
    known = None if prior is None else PlateCamera.read(path.parent / prior)
    initial, fixed = _camera(camera, known)
    stars, images = document["stars"], document["images"]
    star_rows = read_rows(path.parent / stars["file"], ("star", "ra_rad", "dec_rad"))
    image_rows = read_rows(path.parent / images["file"], ("star", "point", "x_m", "y_m", "sidereal_time_rad"))
    ids = tuple(row.cells["star"] for row in star_rows)
    place: dict[str, int] = {}
    for index, row in enumerate(star_rows):
        if place.setdefault(ids[index], index) != index:
            raise row.place.error(f"star {ids[index]} is listed twice")
    for row in image_rows:
        if row.cells["star"] not in place:
            raise row.place.error(f"ERROR 1: star {row.cells['star']} is not listed")
    problem = Problem(
        site=site(document["station"]),
        star_ids=ids,
        star_names=tuple(row.cells.get("name") or row.cells["star"] for row in star_rows),
        star_places=_pairs(star_rows, "ra_rad", "dec_rad"),
        star_weights=_matrices([_star_weight(row, stars.get("weight")) for row in star_rows]),
        image_points=tuple(row.cells["point"] for row in image_rows),
        image_stars=np.array([place[row.cells["star"]] for row in image_rows], np.int64),
        image_groups=np.array([_group(row, images) for row in image_rows], np.int64),
        image_xy=_pairs(image_rows, "x_m", "y_m"),
        image_weights=_matrices([_weight(row, images.get("weight"), _IMAGE_WEIGHT) for row in image_rows]),
        image_times=np.array([_time(row, images) for row in image_rows]),
        initial=initial,
        parameter_weights=_parameter_weights(document.get("weights", {})),
        fixed=fixed,
        axis=_axis(document["axis"]) if "axis" in document else None,
        options=_options(document),
        labels={name: str(value) for name, value in document.get("labels", {}).items()},
    )
    if known is not None:
        problem = known.as_prior(problem, unit)
    reject = document.get("reject", {})
    return rejected(
        problem, {str(s) for s in reject.get("stars", [])}, {str(p) for p in reject.get("points", [])}
    )


def _camera(table: dict[str, Any], prior: PlateCamera | None) -> tuple[Floats, NDArray[np.bool_]]:
    """Read initial values: angles in grads, all else in the units of the parameters."""
    if prior is not None:
        table.setdefault("cx", float(prior.values[INDEX["cx"] - 9]))
    fixed = np.zeros(len(NAMES), bool)
    for name in table.pop("fixed", []):
        fixed[_index(name)] = True
    parameters = default_parameters(float(table["cx"]))
    for angle in ("alpha", "omega", "kappa"):
        if angle in table:
            value = table.pop(angle)
            for group in GROUPS:
                table.setdefault(f"{angle}_{group}", value)
    for name, value in table.items():
        parameters[_index(name)] = float(value) * (GRAD if UNITS[name] == "rad" else 1.0)
    return parameters, fixed


def _index(name: str) -> int:
    if name not in INDEX:
        raise ValueError(f"there is no parameter {name!r}; there are {', '.join(NAMES)}")
    return INDEX[name]


def _parameter_weights(table: dict[str, Any]) -> Floats:
    """Read weights, angles in radians: `name = w`, or `pairs = [[name, name, w], ...]`."""
    table = dict(table)
    weights = np.zeros((len(NAMES), len(NAMES)))
    for first, second, value in table.pop("pairs", []):
        weights[_index(first), _index(second)] = weights[_index(second), _index(first)] = value
    for name, value in table.items():
        weights[_index(name), _index(name)] = value
    return weights


def _pairs(rows: list[Row], first: str, second: str) -> Floats:
    return np.array([[row.required(first), row.required(second)] for row in rows]).reshape(-1, 2)


def _matrices(weights: list[Floats]) -> Floats:
    return np.array(weights).reshape(-1, 2, 2)


def _weight(row: Row, common: list[float] | None, names: tuple[str, str, str]) -> Floats:
    first, second, cross = common if common is not None else [row.number(name) or 0.0 for name in names]
    return np.array([[first, cross], [cross, second]])


def _star_weight(row: Row, common: list[float] | None) -> Floats:
    if row.cells.get("unknown", "") in ("1", "true", "yes"):
        return np.zeros((2, 2))
    return _weight(row, common, _STAR_WEIGHT)


def _orientation(name: str) -> int:
    if name not in GROUPS:
        raise InputError(f"orientation {name!r} is not one of {', '.join(GROUPS)}")
    return GROUPS.index(name)


def _group(row: Row, images: dict[str, Any]) -> int:
    """Take the column `orientation`, else the number of the point as in the deck."""
    if row.cells.get("orientation"):
        try:
            return _orientation(row.cells["orientation"])
        except InputError as error:
            raise row.place.error(error.message) from None
    try:
        trail = abs(int(row.cells["point"])) % 1000
    except ValueError:
        raise row.place.error(f"point {row.cells['point']!r} is not a number: name its orientation") from None
    return 0 if trail < images.get("first_post", 500) else 1 if trail < images.get("first_event", 900) else 2


def _time(row: Row, images: dict[str, Any]) -> float:
    corrections = images.get("time_corrections_rad", [0.0, 0.0, 0.0])
    return row.required("sidereal_time_rad") + float(corrections[_group(row, images)])


def _axis(table: dict[str, Any]) -> Axis:
    xx, yy, xy = table["weight"]
    return Axis(
        azimuth=math.radians(table["azimuth_deg"]),
        zenith_distance=math.radians(table["zenith_distance_deg"]),
        xy=np.array([table.get("x_m", 0.0), table.get("y_m", 0.0)]),
        weight=np.array([[xx, xy], [xy, yy]]),
        group=_orientation(table.get("orientation", "event")),
    )


def _options(document: dict[str, Any]) -> Options:
    table = document.get("options", {})
    unknown = sorted(set(table) - set(_OPTIONS))
    if unknown:
        raise InputError(f"there is no option {listed(unknown)}")
    values = {}
    for name, value in table.items():
        try:
            values[name] = _OPTIONS[name](value)
        except (TypeError, ValueError) as error:
            raise InputError(f"option {name}: {error}") from None
    if "refraction_tolerance_arcsec" in values:
        values["refraction_tolerance"] = values.pop("refraction_tolerance_arcsec") * ARCSEC
    if "comparator_angle_deg" in values:
        values["comparator_angle"] = math.radians(values.pop("comparator_angle_deg"))
    pole = document.get("pole", {})
    return Options(
        reference=site(document["reference"]) if "reference" in document else None,
        pole=(pole.get("x_arcsec", 0.0) * ARCSEC, pole.get("y_arcsec", 0.0) * ARCSEC),
        **values,
    )
