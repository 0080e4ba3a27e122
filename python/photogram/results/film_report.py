"""Films, fiducial marks and scanners as tables, sections and JSON members."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.films import Film, FilmPlacement, FilmSize, Readings, Scanner
from photogram.network.observations import FILM, Fiducial
from photogram.plots.picture_data import VectorField
from photogram.results.films import numbers_of_film
from photogram.results.network_tables import image_axes
from photogram.results.network_trial import OBSERVATION, type_name
from photogram.results.tables import Tests
from photogram.show.page import Drawing, Part, Section, about
from photogram.show.quantity import Axis, Quantity, Table, for_people, members_of_each, of_each

if TYPE_CHECKING:
    from photogram import Result

STEPS = 9  # Positions of a pattern along a side of the format


@dataclass(frozen=True, eq=False)
class MarkResiduals:
    """Residuals of k readings of marks in the frame of the camera, and their tests."""

    photos: Indices  # (k,) row of the photo of each reading
    marks: tuple[str, ...]  # (k,) the name of its mark
    # (k, 2) observed minus computed, mm in the camera's frame, also for rotated and mirrored films
    xy: Floats
    tests: Floats  # (k,) T of both coordinates; NaN without a test


def mark_residuals(result: Result) -> MarkResiduals:
    kind = result.kinds.get(Fiducial.KIND)
    rows = [] if kind is None else kind.rows.tolist()
    read = [each for each in (result.block.observations[row] for row in rows) if isinstance(each, Fiducial)]
    photos = {name: row for row, name in enumerate(result.block.photo_ids)}
    marks = result.fiducials
    xy = np.zeros((len(read), 2))
    for k, each in enumerate(read):
        assert kind is not None
        numbers = np.array(numbers_of_film(result, each.film))
        place = marks[each.mark.name].position[np.newaxis, :2]
        _, partials = _photocore.film_readings(each.film.numbers(), numbers, place)
        xy[k] = np.linalg.solve(partials[0, :, :2], kind.residuals[k])
    tests = np.full(len(read), np.nan)
    for own in Tests(result).groups if read else []:
        if own.kind == type_name(OBSERVATION, Fiducial.KIND):
            tests[own.rows] = own.values
    return MarkResiduals(
        np.array([photos[each.photo] for each in read], dtype=np.int64),
        tuple(each.mark.name for each in read),
        xy,
        tests,
    )


def mean_mark_residuals(result: Result) -> list[VectorField]:
    residuals, block, marks = mark_residuals(result), result.block, result.fiducials
    of = np.zeros(len(block.photo_ids), dtype=np.int64)
    if block.photo_cameras is not None:
        of = block.photo_cameras
    found = []
    of_marks = np.array(residuals.marks, dtype=object)
    for camera in np.unique(of[residuals.photos]).tolist():
        own = of[residuals.photos] == camera
        names = list(dict.fromkeys(of_marks[own].tolist()))
        name = block.camera_names[camera] if block.camera_names else ""
        count = np.unique(residuals.photos[own]).size
        found.append(
            VectorField(
                about("marks.mean", camera=name, n=count),
                np.array([marks[mark].position[:2] for mark in names]),
                np.array([residuals.xy[own & (of_marks == mark)].mean(axis=0) for mark in names]),
                tuple(mark.removeprefix(f"{name} ") for mark in names),
            )
        )
    return found


def film_patterns(result: Result) -> list[VectorField]:
    """Return the systematic deformation of each film with a pattern, over its format."""
    found, own = [], {id(each.given): each.position for each in result.unknowns}
    patterns = {id(film.pattern): film.pattern for _, film in result.films if film.pattern is not None}
    for pattern in patterns.values():
        numbers = np.asarray(pattern.numbers)
        low, high = np.full(2, -numbers[0]), np.full(2, numbers[0])
        if pattern.kind == "grid":
            low, high = numbers[:2], numbers[:2] + (numbers[4:] - 1) * numbers[2:4]
        across, up = np.linspace(low, high, STEPS).T
        places = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
        # D(q) is the reading of an otherwise unchanged film, minus q.
        still = Film(FilmPlacement("still"), FilmSize("still"), Scanner("still"), Readings(), pattern=pattern)
        vectors = np.array([own.get(id(each), each.position) for each in still.unknowns])
        readings, _ = _photocore.film_readings(still.numbers(), vectors, places)
        title = about("film.pattern", name=pattern.weights[0].name, kind=pattern.kind)
        found.append(VectorField(title, places, readings - places))
    return found


_UNITS = ("mm", "mm", "rad", "", "", "")
_SAID = (*(Axis("scale x"), Axis("scale y")), *(Axis.of("between axes", "rad"), Axis.of("rotation", "rad")))
_DEVICE = (Axis.of("Sx", ""), Axis.of("Sy", ""), Axis.of("alpha", "rad"))
_MM = image_axes("mm")


def film_table(result: Result) -> list[Quantity]:
    rows, films = [row for row, _ in result.films], [film for _, film in result.films]
    axes = tuple(Axis.of(name, unit) for name, unit in zip(FILM, _UNITS, strict=True))
    residuals = mark_residuals(result)
    lost = _lost(result, residuals)
    tests = [residuals.tests[residuals.photos == row] for row in rows]
    largest = [np.fmax.reduce(own, initial=-np.inf, dtype=float) for own in tests]
    return [
        _photos(result),
        Quantity([FILM] * len(rows), member="components"),
        Quantity(result.film[rows], axes, "value", member="film", head="{}", figures=7),
        Quantity(result.film_sd[rows], axes, "deviation", member="sd", head="sd {}"),
        Quantity(result.film_cofactors[rows], member="film_cofactors"),
        Quantity([vars(each) for each in result.film_forms.values()], member="affine"),
        Quantity([len(own) for own in tests], member="marks", head="Marks", decimals=0),
        Quantity([lost[row] for row in rows], member="lost"),
        Quantity([" ".join(lost[row]) for row in rows], kind="name", name="lost", head="Lost"),
        Quantity(
            np.where(np.isfinite(largest), largest, np.nan), member="largest_T", head="Largest T", decimals=2
        ),
        *members_of_each(films, "mirrored", scanner="scanner.name"),
    ]


def _photos(result: Result) -> Quantity:
    names = [result.block.photo_ids[row] for row, _ in result.films]
    return Quantity(names, kind="name", member="photo", head="Photo")


def _lost(result: Result, residuals: MarkResiduals) -> dict[int, list[str]]:
    """Return marks read on other photos of a camera only; halves of a scan are one photo."""
    cameras, names = result.block.photo_cameras, result.block.camera_names
    of = {row: 0 if cameras is None else int(cameras[row]) for row, _ in result.films}
    on = {each.photo: each.frame for each in result.block.mounts}
    both = {row: on.get(name, name) for row, name in enumerate(result.block.photo_ids) if row in of}
    read = {name: set[str]() for name in both.values()}
    every: dict[int, dict[str, None]] = {}
    for photo, mark in zip(residuals.photos.tolist(), residuals.marks, strict=True):
        read[both[photo]].add(mark)
        every.setdefault(of[photo], {})[mark] = None
    return {
        row: [
            mark.removeprefix(f"{names[camera]} " if names else "")
            for mark in every.get(camera, {})
            if mark not in read[both[row]]
        ]
        for row, camera in of.items()
    }


def form_table(result: Result) -> list[Quantity]:
    """Return affine forms, `reading = a0 + a1 x + a2 y`, and derived values with sd."""
    forms = list(result.film_forms.values())
    unit = "px" if any(film.readings.pitch != 1.0 for _, film in result.films) else "mm"
    names = [f"{which}{k}" for which in "xy" for k in range(3)]
    matrix = tuple(Axis.of(f"{name[0]} a{name[1]}", unit if name[1] == "0" else "") for name in names)
    said = np.array([[each.scale_x, each.scale_y, each.between_axes, each.rotation] for each in forms])
    said_sd = np.array([each.sd for each in forms])
    matrices, sd = (np.array([getattr(each, what) for each in forms]) for what in ("matrix", "matrix_sd"))
    return [
        _photos(result),
        Quantity(matrices.reshape(-1, 6), matrix, "value", head="{}", figures=9),
        Quantity(sd.reshape(-1, 6), matrix, "deviation", head="sd {}"),
        Quantity(said.reshape(-1, 4), _SAID, "value", head="{}", decimals=7),
        Quantity(said_sd.reshape(-1, 4), _SAID, "deviation", head="sd {}"),
    ]


def mark_table(result: Result) -> list[Quantity]:
    every, residuals, photos = result.fiducials.values(), mark_residuals(result), result.block.photo_ids
    columns = residuals.photos, residuals.marks, residuals.xy, residuals.tests
    readings: dict[str, list[dict[str, Any]]] = {each.name: [] for each in every}
    for photo, mark, xy, test in zip(*columns, strict=True):
        readings[mark].append({"photo": photos[photo], "residual_mm": xy, "T": test})
    means = [
        np.mean([each["residual_mm"] for each in own], axis=0) if own else (np.nan, np.nan)
        for own in readings.values()
    ]
    places, of_marks = partial(Quantity, axes=_MM, decimals=4), partial(of_each, [*every], axes=_MM)
    given = np.array([each.given.position[:2] for each in every])
    return [
        Quantity(list(readings), kind="name", member="fiducial", head="Fiducial"),
        Quantity([len(own) for own in readings.values()], head="Photos", decimals=0),
        places(given, kind="value", member="certificate_mm", head="{}"),
        of_marks("values", kind="value", member="value_mm", head="adjusted {}", decimals=4),
        of_marks("change", kind="difference", member="", head="d {}", decimals=2),
        of_marks("sd", kind="deviation", member="sd_mm", head="sd {}", decimals=2),
        Quantity([each.covariance for each in every], member="covariance_mm2"),
        places(np.reshape(means, (-1, 2)), kind="difference", head="mean residual {}", decimals=2),
        Quantity(list(readings.values()), member="readings"),
    ]


def films_section(result: Result, drawing: Drawing) -> Section:
    if not result.films:
        return Section("films", "Film and fiducials", [])
    of = {id(film.scanner): film.readings for _, film in result.films}
    every = [each for each in result.unknowns if id(each.given) in of]
    of_scanners = partial(of_each, every, axes=_DEVICE)
    readings = [of[id(each.given)] for each in every]
    scanner_table = [
        of_each(every, "name", kind="name", member="scanner", head="Scanner"),
        *members_of_each(readings, pitch_mm="pitch", origin="origin", rows_down="down"),
        Quantity([["Sx", "Sy", "alpha_rad"]] * len(every), member="components"),
        *members_of_each(every, calibration="given.position"),
        of_scanners("values", kind="value", member="value", head="{}", decimals=8),
        of_scanners("change", kind="difference", member="", head="d {}"),
        of_scanners("sd", kind="deviation", head="sd {}"),
        *members_of_each(every, "covariance"),
    ]
    photos, *rest = for_people(form_table(result))
    numbers, said = rest[:2], rest[2:]
    parts: list[Part] = [
        Table("films", "Films", film_table(result), about("films")),
        Table("film-forms", "The same as six numbers", [photos, *numbers], about("film-forms")),
        Table(
            "film-scales", "Scales, angle between the axes, rotation", [photos, *said], about("film-scales")
        ),
        drawing,
        Table("fiducials", "Fiducial marks", mark_table(result), about("fiducials")),
        Table("scanners", "Scanners", scanner_table),
    ]
    return Section("films", "Film and fiducials", parts, about("film-and-fiducials"))
