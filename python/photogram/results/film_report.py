"""What reports and documents say of films, their marks, and scanners."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.network.films import Scanner
from photogram.network.observations import FILM
from photogram.results.film_pictures import MarkResiduals, mark_residuals
from photogram.results.result import Result
from photogram.show.lines import field, stacked, table_lines
from photogram.show.quantity import Axis, Quantity, members

_UNITS = ("mm", "mm", "rad", "", "", "")
_SAID = (*(Axis("scale x"), Axis("scale y")), *(Axis.of("between axes", "rad"), Axis.of("rotation", "rad")))
_DEVICE = (Axis.of("Sx", ""), Axis.of("Sy", ""), Axis.of("alpha", "rad"))
_MM = tuple(Axis(name, "mm", small="um", factor=1e3) for name in "xy")


def film_table(result: Result) -> list[Quantity]:
    """Return the films of photos: values, standard deviations, marks read and lost, the largest test."""
    rows = [row for row, _ in result.films]
    axes = tuple(Axis.of(name, unit) for name, unit in zip(FILM, _UNITS, strict=True))
    residuals = mark_residuals(result)
    lost = _lost(result, residuals)
    read = [int(np.count_nonzero(residuals.photos == row)) for row in rows]
    largest = [
        np.fmax.reduce(residuals.tests[residuals.photos == row], initial=-np.inf, dtype=float) for row in rows
    ]
    return [
        _photos(result),
        Quantity(result.film[rows], axes, "value", label="value", head="{}", figures=7),
        Quantity(result.film_sd[rows], axes, "deviation", label="sd", head="sd {}"),
        Quantity(read, head="Marks", decimals=0),
        Quantity([" ".join(lost[row]) for row in rows], kind="name", name="lost", head="Lost"),
        Quantity(np.where(np.isfinite(largest), largest, np.nan), head="Largest T", decimals=2),
    ]


def _photos(result: Result) -> Quantity:
    names = [result.block.photo_ids[row] for row, _ in result.films]
    return Quantity(names, kind="name", head="Photo")


def _lost(result: Result, residuals: MarkResiduals) -> dict[int, list[str]]:
    """Return the marks that were read on other photos of a camera, by the row of the photo.

    The halves of a joined scan are one photo in this.
    """
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
    """Return the forms of six numbers, `reading = a0 + a1 x + a2 y`, and what they say, with deviations."""
    forms = list(result.film_forms.values())
    unit = "px" if any(film.readings.pitch != 1.0 for _, film in result.films) else "mm"
    names = [f"{which}{k}" for which in "xy" for k in range(3)]
    matrix = tuple(Axis.of(f"{name[0]} a{name[1]}", unit if name[1] == "0" else "") for name in names)
    said = np.array([[each.scale_x, each.scale_y, each.between_axes, each.rotation] for each in forms])
    said_sd = np.array([each.sd for each in forms])
    matrices, sd = (np.array([getattr(each, what) for each in forms]) for what in ("matrix", "matrix_sd"))
    return [
        _photos(result),
        Quantity(matrices.reshape(-1, 6), matrix, "value", label="a", head="{}", figures=9),
        Quantity(sd.reshape(-1, 6), matrix, "deviation", label="sd", head="sd {}"),
        Quantity(said.reshape(-1, 4), _SAID, "value", label="value", head="{}", decimals=7),
        Quantity(said_sd.reshape(-1, 4), _SAID, "deviation", label="sd", head="sd {}"),
    ]


def mark_table(result: Result) -> list[Quantity]:
    """Return the marks of cameras: adjusted, less the certificate, and mean residuals of their readings."""
    marks, residuals = result.fiducials, mark_residuals(result)
    means, counts = np.full((len(marks), 2), np.nan), np.zeros(len(marks))
    of = np.array(residuals.marks, dtype=object)
    for k, name in enumerate(marks):
        own = residuals.xy[of == name]
        counts[k] = len(own)
        if len(own):
            means[k] = own.mean(axis=0)
    given, values, changes, sd = (
        np.array(each).reshape(-1, 2)
        for each in (
            [mark.given.position[:2] for mark in marks.values()],
            *([getattr(mark, what) for mark in marks.values()] for what in ("values", "change", "sd")),
        )
    )
    return [
        Quantity(list(marks), kind="name", head="Fiducial"),
        Quantity(counts, head="Photos", decimals=0),
        Quantity(given, _MM, "value", head="{}", decimals=4),
        Quantity(values, _MM, "value", head="adjusted {}", decimals=4),
        Quantity(changes, _MM, "difference", head="d {}", decimals=2),
        Quantity(sd, _MM, "deviation", head="sd {}", decimals=2),
        Quantity(means, _MM, "difference", head="mean residual {}", decimals=2),
    ]


def _scanners(result: Result) -> list[Any]:
    return [each for each in result.unknowns if isinstance(each.given, Scanner)]


def scanner_table(result: Result) -> list[Quantity]:
    """Return the scanners: adjusted, less their calibrations, standard deviations."""
    every = _scanners(result)
    values, changes, sd = (
        np.array([getattr(each, what) for each in every]).reshape(-1, 3)
        for what in ("values", "change", "sd")
    )
    return [
        Quantity([each.name for each in every], kind="name", head="Scanner"),
        Quantity(values, _DEVICE, "value", label="value", head="{}", decimals=8),
        Quantity(changes, _DEVICE, "difference", label="change", head="d {}"),
        Quantity(sd, _DEVICE, "deviation", label="sd", head="sd {}"),
    ]


def film_lines(result: Result) -> list[str]:
    """Write the films of photos, their forms of six numbers, the marks of cameras, and scanners."""
    photos, values, sd, marks, lost, largest = film_table(result)
    if not len(photos.values):
        return []
    first = [*field(marks, 8, ".0f", "marks"), *field(largest, 10, ".2f", "largest T")]
    first += field(lost, 0, head="lost", gap="  ")
    films = stacked(photos, "photo", [(values, ".7f"), (sd, ".7f")], first)
    _, matrix, matrix_sd, said, said_sd = form_table(result)
    forms = stacked(photos, "photo", [(matrix, ".7f"), (matrix_sd, ".7f")])
    scales = stacked(photos, "photo", [(said, ".7f"), (said_sd, ".7f")])
    every, *device = scanner_table(result)
    return [
        *(line.rstrip() for line in films),
        *("", "reading = a0 + a1 x + a2 y, x and y in the frame of the marks (mm)", *forms),
        *("", "mm of the film in a mm of the camera; angle between the axes less 90 degrees", *scales),
        *("", "certificate and adjusted; mean residuals of readings in the frame of the camera"),
        *_mark_lines(result),
        *("", *stacked(every, "scanner", [(each, ".8f") for each in device])),
    ]


def _mark_lines(result: Result) -> list[str]:
    names, photos, given, _, *numbers = mark_table(result)
    width = max([20, *(len(name) + 2 for name in names.values)])
    heads = ("{name} {unit}", "d {name} {unit}", "sd {name} {unit}", "mean v{name} {unit}")
    forms = zip([given, *numbers], (".4f", *[".2f"] * 3), heads, strict=True)
    fields = [each for own, form, head in forms for each in field(own, 13, form, head)]
    first = [*field(names, width, head="fiducial"), *field(photos, 7, ".0f", "photos")]
    return table_lines([*first, *fields])


def film_members(result: Result) -> list[dict[str, object]]:
    """Return the films of photos for documents: values, cofactors, the form of six numbers, the side."""
    *_, marks, lost, largest = film_table(result)
    arrays = {"film": result.film, "sd": result.film_sd, "film_cofactors": result.film_cofactors}
    forms = result.film_forms.values()
    return [
        {
            "photo": result.block.photo_ids[row],
            "components": FILM,
            **{name: values[row] for name, values in arrays.items()},
            "affine": vars(form),
            "marks": marks.values[k],
            "lost": lost.values[k].split(),
            "largest_T": largest.values[k],
            **members(film, "mirrored", scanner="scanner.name"),
        }
        for k, ((row, film), form) in enumerate(zip(result.films, forms, strict=True))
    ]


def fiducial_members(result: Result) -> list[dict[str, object]]:
    """Return the marks of cameras for documents: certificate and adjusted, covariance, readings."""
    residuals, photos = mark_residuals(result), result.block.photo_ids
    columns = residuals.photos, residuals.marks, residuals.xy, residuals.tests
    readings: dict[str, list[dict[str, object]]] = {}
    for photo, mark, xy, test in zip(*columns, strict=True):
        readings.setdefault(mark, []).append({"photo": photos[photo], "residual_mm": xy, "T": test})
    return [
        {
            "fiducial": name,
            "certificate_mm": each.given.position[:2],
            **members(each, value_mm="values", sd_mm="sd", covariance_mm2="covariance"),
            "readings": readings.get(name, []),
        }
        for name, each in result.fiducials.items()
    ]


def scanner_members(result: Result) -> list[dict[str, object]]:
    """Return the scanners for documents: what their readings count, calibration and adjusted, covariance."""
    counted = {id(film.scanner): film.readings for _, film in result.films}
    return [
        {
            "scanner": each.name,
            **members(counted[id(each.given)], pitch_mm="pitch", origin="origin", rows_down="down"),
            "components": ["Sx", "Sy", "alpha_rad"],
            **members(each, calibration="given.position", value="values", sd="sd", covariance="covariance"),
        }
        for each in _scanners(result)
        if id(each.given) in counted
    ]
