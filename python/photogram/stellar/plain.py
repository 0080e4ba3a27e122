"""Plates in TOML and CSV files, and parts that nights share (`docs/stellar-camera.md`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence, Set
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.objects import path_of
from photogram.arguments.types import Bools, Floats
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import read_records
from photogram.io.numbers import ARCSEC
from photogram.io.places import Place, at_place
from photogram.io.toml import TomlTree, read_document, read_toml
from photogram.lazy_dataclasses import fields, replace
from photogram.stellar.cameras import PlateCamera
from photogram.stellar.catalogue import star_key
from photogram.stellar.parameters import GRAD, GROUPS, INDEX, NAMES, UNITS
from photogram.stellar.places import sidereal_time
from photogram.stellar.problem import Axis, Options, Problem, default_parameters, rejected
from photogram.stellar.sky import ABERRATION, HECTOPASCAL, HOUR, Air, Effects, Site, landmark
from photogram.words import phrase

_STATION = {
    "latitude_deg",
    "longitude_east_deg",
    "longitude_west_deg",
    "elevation_m",
    "temperature_K",
    "pressure_hPa",
    "pressure_mmHg",
    "aberration_arcsec",
    "number",
    "name",
}


def inputs(path: Path) -> list[Path]:
    """Return a file of a plate or night, and the files that it names: results must not replace them."""
    tables = [table for _, table in read_toml(path).items() if isinstance(table.value, dict)]
    keys = ("file", "prior", "start")
    return [path, *(table[key].named_file() for table in tables for key in keys if key in table)]


def effects(table: TomlTree) -> Effects:
    """Return the effects on apparent positions, except for disabled ones."""
    return Effects(**{one.name: table.get(one.name, True).switch() for one in fields(Effects)})


def site(table: TomlTree) -> Site:
    """Return the station of a table."""
    table.only(_STATION)
    latitude = table["latitude_deg"].number(-90, 90)
    temperature = table.get("temperature_K", 273.15).number()
    if table.says("pressure_hPa", "pressure_mmHg"):
        pressure = table["pressure_hPa"].number() / HECTOPASCAL
    else:
        pressure = table.get("pressure_mmHg", 760.0).number()
    if table.says("longitude_east_deg", "longitude_west_deg"):
        west = -table["longitude_east_deg"].number(-360, 360)
    else:
        west = table.get("longitude_west_deg", 0.0).number(-360, 360)
    with at_place(table):
        air = Air(temperature, pressure)
    return Site(
        latitude=math.radians(latitude),
        longitude_west=math.radians(west),
        elevation=table.get("elevation_m", 0.0).number(-500, 100_000),
        air=air,
        aberration=table["aberration_arcsec"].number(0, 1) * ARCSEC
        if "aberration_arcsec" in table
        else ABERRATION,
        number=table.get("number", "").word(),
        name=table.get("name", "").word(),
    )


def pole_arcsec(table: TomlTree, key: str) -> float:
    """Return a coordinate of the pole; zero if it is missing."""
    return table.get(key, 0.0).number(-2, 2)


_READERS: dict[type, Callable[[TomlTree], Any]] = {
    bool: TomlTree.switch,
    int: TomlTree.whole,
    float: TomlTree.number,
    tuple: TomlTree.words,
}
"""Readers of options by the types of their defaults."""
_OPTIONS_IN_UNITS = {
    "refraction_tolerance_arcsec": ("refraction_tolerance", ARCSEC),
    "comparator_angle_deg": ("comparator_angle", math.radians(1)),
}
_OTHER_OPTIONS = ("reference", "pole", "refraction_tolerance", "comparator_angle")
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

    InputError: if a file cannot be read, or if values are invalid. The message has the file, and the record
    of a CSV file.

    Parameters
    ----------
    path
        TOML file. It names the CSV files of stars and images, relative to its folder.
    """
    path = path_of("path", path)
    document = read_document(path, _TABLES)
    with at_place(Place(path)):
        return _problem(document)


def _problem(document: TomlTree) -> Problem:
    camera = document["camera"]
    known = PlateCamera.read(camera["prior"].named_file()) if "prior" in camera else None
    unit = camera["prior_unit_m"].positive() if "prior_unit_m" in camera else None
    initial, fixed = _camera(camera, known)
    stars, images = document["stars"], document["images"]
    star_table = _table(stars, "star", "ra_rad", "dec_rad")
    image_table = _table(images, "star", "point", "x_m", "y_m")
    station = replace(site(document["station"]), effects=effects(document.table("places")))
    ids, seen = tuple(star_table.texts("star")), image_table.texts("star")
    place: dict[str, int] = {}
    for row, name in enumerate(ids):
        if place.setdefault(star_key(name), row) != row:
            raise star_table.error(row, phrase("error.repeated", kind="star", name=name))
    for row, name in enumerate(seen):
        if star_key(name) not in place:
            raise image_table.error(row, phrase("stars.unlisted", star=name))
    places, weights, on_ground = _stars(stars, star_table, station)
    options = _options(document)
    landmarks = {star_key(ids[row]) for row in np.flatnonzero(on_ground).tolist()}
    if landmarks and options.refraction:
        raise stars["file"].error(phrase("stars.landmarks-and-refraction"))
    dut1 = document.table("places").get("dut1_s", 0.0).number(-1, 1)
    sidereal = partial(sidereal_time, station, dut1=dut1)
    groups, times = _groups_and_times(images, image_table, landmarks, sidereal)
    problem = Problem(
        site=station,
        star_ids=ids,
        star_names=tuple(name or star for name, star in zip(star_table.texts("name"), ids, strict=True)),
        star_places=places,
        star_weights=weights,
        image_points=tuple(image_table.texts("point")),
        image_stars=np.array([place[star_key(name)] for name in seen], np.int64),
        image_groups=np.array(groups, np.int64),
        image_xy=image_table.given(("x_m", "y_m")),
        image_weights=_weights(images, image_table, _IMAGE_WEIGHT),
        image_times=np.array(times),
        initial=initial,
        parameter_weights=_parameter_weights(document.table("weights")),
        fixed=fixed,
        axis=_axis(document["axis"]) if "axis" in document else None,
        options=options,
        labels={name: document.table("labels")[name].word() for name in document.table("labels").value},
    )
    if known is not None:
        problem = known.as_prior(problem, unit)
    reject = document.table("reject")
    return rejected(problem, set(reject.get("stars", ()).words()), set(reject.get("points", ()).words()))


def _camera(table: TomlTree, prior: PlateCamera | None) -> tuple[Floats, Bools]:
    """Read initial values: angles in grads, others in the units of the parameters."""
    fixed = np.zeros(len(NAMES), bool)
    for name in table.get("fixed", ()).words():
        fixed[_index(table, name)] = True
    values = {name: name for name in table.value if name not in ("prior", "prior_unit_m", "fixed")}
    for angle in ("alpha", "omega", "kappa"):
        if values.pop(angle, None):
            for group in GROUPS:
                values.setdefault(f"{angle}_{group}", angle)
    c = None if prior is None else float(prior.values[INDEX["cx"] - 9])
    parameters = default_parameters(table.get("cx", c).positive())
    for name, key in values.items():
        index = _index(table, name)
        parameters[index] = table[key].number() * (GRAD if UNITS[name] == "rad" else 1.0)
    return parameters, fixed


def _index(table: TomlTree, name: str) -> int:
    if name not in INDEX:
        raise table.at(name).error(phrase("error.choice", value=name, names=list(NAMES)))
    return INDEX[name]


def _parameter_weights(table: TomlTree) -> Floats:
    """Read weights, angles in radians: `name = w`, or `pairs = [[name, name, w], ..]`."""
    weights = np.zeros((len(NAMES), len(NAMES)))
    for pair in table.get("pairs", []):
        cells = list(pair)
        if len(cells) != 3:
            raise pair.value_error("toml.row", count=3)
        row, column = (_index(table, cell.word()) for cell in cells[:2])
        weights[row, column] = weights[column, row] = cells[2].number()
    for name in table.value:
        if name != "pairs":
            weights[_index(table, name), _index(table, name)] = table[name].number(low=0)
    return weights


def _table(table: TomlTree, *columns: str) -> ColumnTable:
    found = read_records(table["file"].named_file(), ragged=True)
    found.require(*columns)
    return found


def _weights(table: TomlTree, rows: ColumnTable, names: Sequence[str]) -> Floats:
    """Return (n, 2, 2) weights of rows, or the common one."""
    values = np.nan_to_num(rows.vectors(names))
    if "weight" in table:
        values[:] = table["weight"].numbers(3, infinite=True)
    return values[:, [[0, 2], [2, 1]]]


def _stars(table: TomlTree, rows: ColumnTable, station: Site) -> tuple[Floats, Floats, Bools]:
    """Return places and weights, and the landmarks, which have a terrestrial direction instead."""
    places, weights = rows.vectors(("ra_rad", "dec_rad")), _weights(table, rows, _STAR_WEIGHT)
    weights[np.isin(rows.texts("unknown"), ("1", "true", "yes"))] = 0.0
    directions = rows.vectors(("azimuth_north_deg", "elevation_deg"))
    landmarks = np.isfinite(directions[:, 0])
    for row in np.flatnonzero(landmarks).tolist():
        azimuth, elevation = np.radians(directions[row]).tolist()
        with at_place(rows.place(row)):
            places[row], weights[row] = landmark(station, azimuth, elevation, weights[row])
    rows.check_given(places, ("ra_rad", "dec_rad"))
    if wrong := np.flatnonzero(~landmarks & (np.abs(places[:, 1]) > math.pi / 2)).tolist():
        fields = {"star": rows.texts("star")[wrong[0]], "value": float(places[wrong[0], 1])}
        raise rows.error(wrong[0], phrase("stars.declination", **fields))
    return places, weights, landmarks


def _groups_and_times(
    table: TomlTree, rows: ColumnTable, landmarks: Set[str], sidereal: Callable[[str], float]
) -> tuple[list[int], list[float]]:
    """Return groups and sidereal times of images.

    The group is in the column `orientation`, else it follows from the point number as in the deck.
    """
    post, event = table.get("first_post", 500).whole(), table.get("first_event", 900).whole()
    corrections = table.get("time_corrections_rad", [0.0, 0.0, 0.0]).numbers(3)
    groups, times = [], []
    given = rows.numbers("sidereal_time_rad").tolist()
    columns = (rows.texts(name) for name in ("star", "point", "orientation", "utc"))
    for row, (star, point, name, utc) in enumerate(zip(*columns, strict=True)):
        digits = point.removeprefix("-")
        if name:
            if name not in GROUPS:
                raise rows.cell_error(row, "orientation", "error.choice", value=name, names=GROUPS)
            group = GROUPS.index(name)
        elif digits.isascii() and digits.isdigit():
            # The trail is the last three digits.
            trail = int(digits[-3:])
            group = 0 if trail < post else 1 if trail < event else 2
        else:
            raise rows.error(row, phrase("stars.no-orientation", point=point))
        time = given[row] + corrections[group]
        if star_key(star) in landmarks:
            time = HOUR
        elif utc:
            with at_place(rows.place(row)):
                time = sidereal(utc) + corrections[group]
        elif math.isnan(time):
            raise rows.cell_error(row, "sidereal_time_rad", "error.empty")
        groups.append(group)
        times.append(time)
    return groups, times


def _axis(table: TomlTree) -> Axis:
    xx, yy, xy = table["weight"].numbers(3, infinite=True)
    group = table.get("orientation", "event").choice(GROUPS)
    return Axis(
        azimuth=math.radians(table["azimuth_deg"].number(-360, 360)),
        zenith_distance=math.radians(table["zenith_distance_deg"].number(-90, 90)),
        xy=np.array([table.get("x_m", 0.0).number(), table.get("y_m", 0.0).number()]),
        weight=np.array([[xx, xy], [xy, yy]]),
        group=GROUPS.index(group),
    )


def _options(document: TomlTree) -> Options:
    table, pole = document.table("options"), document.table("pole")
    plain = {field.name: field.default for field in fields(Options) if field.name not in _OTHER_OPTIONS}
    table.only([*plain, *_OPTIONS_IN_UNITS])
    values = {name: _READERS[type(default)](table[name]) for name, default in plain.items() if name in table}
    for key, (name, unit) in _OPTIONS_IN_UNITS.items():
        if key in table:
            values[name] = table[key].number() * unit
    return Options(
        reference=site(document.table("reference")) if "reference" in document else None,
        pole=(pole_arcsec(pole, "x_arcsec") * ARCSEC, pole_arcsec(pole, "y_arcsec") * ARCSEC),
        **values,
    )
