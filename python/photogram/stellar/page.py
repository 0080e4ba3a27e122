"""The page of a camera that was calibrated by a plate with stars."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from photogram.show.angles import ARCSEC
from photogram.show.judgement import judged, remarks_section, tests_section
from photogram.show.methods import page_of
from photogram.show.page import (
    Cell,
    Column,
    Document,
    Drawing,
    Fact,
    Facts,
    Layers,
    Part,
    Row,
    Section,
    Table,
    decimals_of,
    fixed,
    significant,
)
from photogram.show.sketch.declared import Sketch
from photogram.stellar import tables
from photogram.stellar.curves import distortion_curves
from photogram.stellar.outliers import studentized
from photogram.stellar.parameters import GRAD, INDEX, NAMES, UNITS
from photogram.stellar.plots import sketches
from photogram.stellar.result import Ellipse, Result

WORST = 25
"""Plate coordinates in the table of the worst."""


@page_of.register(Result)
def plate_page(result: Result) -> Document:
    """Return the report of a plate for the browser."""
    sections = [
        Section(
            "pictures", "Stars and residuals", [Layers("picture-layers", plate_pictures(sketches(result)))]
        ),
        Section(
            "size", "How much, how good", [Facts("How much", _much(result)), Facts("How good", _good(result))]
        ),
        Section("parameters", "Parameters", [_parameters(result)], _PARAMETERS),
        Section("worst", "Worst observations", [_worst(result)]),
        tests_section(result.verdict),
        Section("directions", "Unknown directions", _directions(result), _DIRECTIONS),
        Section("distortion", "Distortion", _distortion(result), _DISTORTION),
        Section("movement", "Movement of the camera", _movement(result), _MOVEMENT),
        remarks_section(result.messages),
    ]
    return Document(
        what="Calibration of a camera by a plate with stars",
        title=result.problem.labels.get("title", ""),
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
        highlights=_highlights(result),
        sections=sections,
    )


_PARAMETERS = (
    "Lengths in metres, angles in grads (400 to the circle). A parameter that was weighted has a mean"
    " error before; one"
    " that is held has none after."
)


def plate_pictures(drawn: dict[str, Sketch]) -> list[Drawing]:
    """Return pictures by their names, as they stand on a page."""
    return [
        Drawing(f"picture-{name}", name[:1].upper() + name[1:], "", partial(drawn.get, name))
        for name in drawn
    ]


_UNIT = "of a plate coordinate of weight 1"


def _highlights(result: Result) -> list[Fact]:
    rms = np.sqrt((result.solved.residuals**2).mean(axis=0)) * 1e6
    known = int(result.problem.known.sum())
    return [
        Fact("Mean error of unit weight", significant(1e6 * result.mean_error, 4), "µm", _UNIT),
        Fact(
            "rms of plate residuals, x",
            significant(float(rms[0]), 3),
            "µm",
            f"y {significant(float(rms[1]), 3)} µm",
        ),
        Fact(
            "Stars",
            f"{len(result.problem.star_ids)}",
            note=f"{known} known, {len(result.problem.image_stars)} images",
        ),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom}"),
    ]


def _much(result: Result) -> list[Fact]:
    problem, counts = result.problem, result.counts
    known = int(problem.known.sum())
    return [
        Fact("Stars", f"{known} known, {len(problem.star_ids) - known} unknown"),
        Fact("Images on the plate", f"{len(problem.image_stars)}"),
        Fact(
            "Observations",
            f"{counts.observations}",
            note=f"{counts.plate_observations} of the plate, {counts.star_observations} of stars,"
            f" {counts.parameter_observations} of parameters",
        ),
        Fact(
            "Unknowns",
            f"{counts.unknowns}",
            note=f"{counts.parameter_unknowns} parameters, {counts.star_unknowns} of stars",
        ),
        Fact("Degrees of freedom", f"{counts.degrees_of_freedom}"),
        Fact("Stop", result.solved.stop.capitalize()),
    ]


def _good(result: Result) -> list[Fact]:
    plate, stars, parameters = (float(each) for each in result.solved.sums)
    return [
        Fact("Mean error of unit weight, computed", significant(1e6 * result.computed_mean_error, 5), "µm"),
        Fact("Mean error of unit weight, in use", significant(1e6 * result.mean_error, 5), "µm", _UNIT),
        Fact("Weighted sum of squares, plate", significant(1e12 * plate, 6), "µm²"),
        Fact("Weighted sum of squares, stars", significant(1e12 * stars, 6), "µm²"),
        Fact("Weighted sum of squares, parameters", significant(1e12 * parameters, 6), "µm²"),
    ]


def _parameters(result: Result) -> Table:
    problem, errors = result.problem, result.mean_errors
    rows: list[Row] = []
    for name in NAMES:
        i = INDEX[name]
        if name not in result.estimated and name in NAMES[22:]:
            continue
        unit = 1.0 / GRAD if UNITS[name] == "rad" else 1.0
        weight = problem.parameter_weights[i, i]
        after = errors[name] * unit if name in result.estimated else math.nan
        decimals = min(decimals_of(np.array([after])) + 1, 12) if after > 0 else None
        rows.append(
            [
                f"{name}, {'grads' if UNITS[name] == 'rad' else UNITS[name]}".rstrip(", "),
                _written(problem.initial[i] * unit, decimals),
                result.mean_error / math.sqrt(weight) * unit if weight else "free" if after > 0 else "held",
                _written(result.parameters[name] * unit, decimals),
                after if after > 0 else None,
                result.significance().get(name),
            ]
        )
    columns = (
        Column("Parameter", text=True),
        Column("Given"),
        Column("Mean error before", figures=3),
        Column("Computed"),
        Column("Mean error after", figures=3),
        Column("Over its mean error", decimals=1),
    )
    return Table("Parameters", columns, rows)


def _written(value: float, decimals: int | None) -> Cell:
    value = float(value)
    return Cell(significant(value, 9) if decimals is None else fixed(value, decimals), sorts=value)


def _worst(result: Result) -> Table:
    problem, tests = result.problem, studentized(result)
    sizes = np.nan_to_num(np.abs(tests.images))
    rows: list[Row] = []
    for flat in np.argsort(-sizes, axis=None, kind="stable")[:WORST].tolist():
        image, axis = np.unravel_index(flat, sizes.shape)
        rows.append(
            [
                str(problem.image_points[image]),
                str(problem.star_ids[problem.image_stars[image]]),
                "xy"[axis],
                1e6 * float(result.solved.residuals[image, axis]),
                float(tests.images[image, axis]),
            ]
        )
    columns = (
        Column("Point", text=True),
        Column("Star", text=True),
        Column("Coordinate", text=True),
        Column("Residual", "µm", decimals=2),
        Column(f"Test value {'w' if tests.known else 't'}", decimals=2),
    )
    return Table(
        "Worst observations", columns, rows, f"The {len(rows)} plate coordinates of the largest test values."
    )


_DIRECTIONS = (
    "Stars whose places were to be found, with mean errors, and the semi-axes and directions of their"
    " ellipses: from the orientation alone, and in total."
)


def _directions(result: Result) -> list[Part]:
    rows: list[Row] = [
        [
            str(each.star),
            Cell(tables.hours(each.place[0] % math.tau), sorts=each.place[0] % math.tau),
            Cell(tables.degrees(each.place[1]), sorts=each.place[1]),
            math.degrees(each.azimuth),
            math.degrees(each.elevation),
            *(float(error) / ARCSEC for error in each.mean_errors),
            1e6 * each.image_mean_error,
            *_axes(each.orientation),
            *_axes(each.total),
        ]
        for each in result.directions()
    ]
    columns = (
        Column("Star", text=True),
        Column("Right ascension"),
        Column("Declination"),
        Column("Azimuth from south, positive west", "°", decimals=5),
        Column("Elevation", "°", decimals=5),
        Column("Mean error, right ascension", "″", decimals=4),
        Column("declination", "″", decimals=4),
        Column("image", "µm", decimals=3),
        *(
            Column(f"{name}{of}", unit, decimals=decimals)
            for of in (", orientation", ", total")
            for name, unit, decimals in (("a", "″", 4), ("b", "″", 4), ("Direction", "°", 2))
        ),
    )
    return [Table("Unknown directions", columns, rows)] if rows else []


def _axes(found: Ellipse) -> tuple[float, float, float]:
    return found.major / ARCSEC, found.minor / ARCSEC, math.degrees(found.direction)


_DISTORTION = (
    "Over the distance from its centre, with mean errors. Transformed: for the calibrated principal distance,"
    " with which it is zero at the crossover."
)


def _distortion(result: Result) -> list[Part]:
    options = result.problem.options
    if not options.curves:
        return []
    curves = distortion_curves(result)
    facts = [
        Fact(
            "Calibrated principal distance",
            f"{curves.calibrated:.9f}",
            "m",
            f"mean error {significant(1e6 * curves.calibrated_error, 4)} µm",
        ),
        Fact("Crossover", f"{1e3 * options.crossover:g}", "mm"),
    ]
    parts = [
        each
        for curve, error in (
            (curves.radial, curves.radial_error),
            (curves.transformed, curves.transformed_error),
            (curves.decentering, curves.decentering_error),
        )
        for each in (curve, error)
    ]
    table = np.column_stack([1e3 * curves.distance, *(1e6 * each for each in parts)])
    columns = (
        Column("Distance", "mm", decimals=1),
        *(
            Column(head, "µm", decimals=3)
            for name in ("Radial", "Transformed", "Decentering")
            for head in (name, "Mean error")
        ),
    )
    rows: list[Row] = [list(row) for row in table.tolist()]
    return [Facts("Principal distance", facts), Table("Distortion", columns, rows)]


_MOVEMENT = "Angles between the directions of a point of the plate under two attitudes."


def _movement(result: Result) -> list[Part]:
    rows: list[Row] = [
        [
            f"{each.second} - {each.first}",
            1e3 * each.xy,
            each.angle / ARCSEC,
            each.mean_error / ARCSEC,
            *(float(value) / ARCSEC for value in each.differences),
        ]
        for each in result.movement
    ]
    columns = (
        Column("Pair", text=True),
        Column("x = y", "mm", decimals=0),
        Column("Angle", "″", decimals=3),
        Column("Mean error", "″", decimals=3),
        *(
            Column(name, "″", decimals=3)
            for name in ("ra cos dec", "Declination", "Azimuth sin z", "Elevation")
        ),
    )
    return [Table("Movement of the camera", columns, rows)] if rows else []
