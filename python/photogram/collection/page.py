"""The page of an adjusted collection of photos."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from photogram.collection.adjusted import AdjustedCollection
from photogram.collection.findings import names, tested_observations
from photogram.collection.report import problems_of
from photogram.results.page.frame import Frame
from photogram.results.page.observed import Images, observed_table, worst_images, worst_of
from photogram.results.page.parts import (
    images_facts,
    iterations_section,
    precision_table,
    tests_section,
    unit_weight,
    worst_section,
)
from photogram.results.page.pictures import drawings
from photogram.results.page.tables import CONDITION_NOTE, RATIO_NOTE, chosen_rows
from photogram.results.weakest import weakest_photos, weakest_points
from photogram.show.judgement import judged, remarks_section
from photogram.show.page import (
    Cell,
    Column,
    Drawing,
    Fact,
    Facts,
    Layers,
    Page,
    Part,
    Row,
    Section,
    Table,
    significant,
)
from photogram.statistics.findings import by_t

__all__ = ["collection_page"]


@np.errstate(over="ignore", invalid="ignore")
def collection_page(result: AdjustedCollection) -> Page:
    """Return the report of an adjusted collection for the browser."""
    given, (photos, points) = result.collection, names(result)
    images = Images(given.image_photos, photos, points, "px", 1.0, given.image_xy)
    pictures = drawings(result)
    omega, freedom = result.weighted_sum_of_squares, result.degrees_of_freedom
    groups = [by_t(each, omega, freedom) for each in tested_observations(result)]
    found = worst_of(groups)
    worst = worst_images(found)
    sections = [
        Section("network", "Plan of the network", [pictures["network"]] if "network" in pictures else []),
        _size_section(result),
        Section("residuals", "Image residuals", [pictures["residuals"]] if "residuals" in pictures else []),
        Section(
            "redundancy",
            "Redundancy",
            [pictures["redundancy"]] if "redundancy" in pictures else [],
            _REDUNDANCY,
        ),
        tests_section(result, pictures.get("tests")),
        worst_section(result, images, groups, found),
        _weighted_section(result),
        _cameras_section(pictures),
        _photos_section(result, given.image_photos[worst].tolist()),
        _points_section(result, given.image_points[worst].tolist()),
        iterations_section(result),
        remarks_section(problems_of(result)),
    ]
    return Page(
        what="Adjustment of a collection of photos",
        title="",
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
        highlights=_highlights(result),
        sections=sections,
        phases=result.seconds,
    )


_REDUNDANCY = (
    "The redundancy number of an observation is the share of its error that shows in its own residual;"
    " the rest"
    " goes into the unknowns."
)


def _highlights(result: AdjustedCollection) -> list[Fact]:
    used = result.residuals[result.used_images]
    found = [
        unit_weight(result),
        Fact(
            "Photos",
            f"{np.count_nonzero(result.photo_images):,}",
            note=f"{np.count_nonzero(result.used_points):,} points, {len(used):,} images",
        ),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom:,.0f}"),
    ]
    if used.size:
        rms, middle = math.sqrt(float((used**2).mean())), float(np.median(np.hypot(*used.T)))
        found.append(
            Fact(
                "rms of image residuals",
                significant(rms, 3),
                "px",
                f"median length {significant(middle, 3)} px",
            )
        )
    return found


def _size_section(result: AdjustedCollection) -> Section:
    given = result.collection
    facts = [
        Fact("Photos", f"{np.count_nonzero(result.photo_images)} used of {len(given.photo_parameters)}"),
        Fact("Points", f"{np.count_nonzero(result.used_points)} used of {len(given.point_positions)}"),
        Fact("Image points", f"{np.count_nonzero(result.used_images)} used of {len(given.image_xy)}"),
        Fact("Camera", given.camera, note=f"unknowns of a photo: {', '.join(given.parameters)}"),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom:.8g}"),
    ]
    if result.datum:
        held = [f"{name} of photo {photo}" for photo, name in result.datum]
        facts.append(Fact("Datum", "held parameters", note=", ".join(held)))
    behind = int(np.count_nonzero(result.point_rays_behind))
    if behind:
        facts.append(Fact("Points behind a camera", f"{behind}", tone="look"))
    variance = result.variance_of_unit_weight
    good = [
        Fact(
            "Cost at first, half the sum of squares",
            significant(0.5 * result.initial_weighted_sum_of_squares, 7),
        ),
        Fact("Cost", significant(result.cost, 7)),
        Fact("Variance of unit weight", f"{variance:.6f}" if variance is not None else "undefined"),
        *images_facts(result, "px", 1.0),
    ]
    precision = precision_table(
        [
            ("points", "XYZ", [""] * 3, result.point_sd[result.used_points]),
            ("photos", given.parameters, given.units, result.photo_sd),
        ]
    )
    parts: list[Part] = [
        Facts("How much", facts),
        Facts("How good", good),
        *([precision] if precision else []),
    ]
    return Section("size", "How much, how good", parts)


def _frame(labels: Iterable[str], units: Iterable[str]) -> Frame:
    labels, units = tuple(labels), tuple(units)
    return Frame(labels, units, np.ones(len(labels)), ("",) * len(labels))


def _weighted_section(result: AdjustedCollection) -> Section:
    given, (photos, points) = result.collection, names(result)
    tables = [
        observed_table(
            "Weighted and fixed points",
            "point",
            points,
            _frame("XYZ", [""] * 3),
            result.control,
            given.point_positions,
            result.point_positions,
            result.point_sd,
        ),
        observed_table(
            "Weighted and fixed parameters of photos",
            "photo",
            photos,
            _frame(given.parameters, given.units),
            result.stations,
            given.photo_parameters,
            result.photo_parameters,
            result.photo_sd,
        ),
    ]
    return Section("weighted", "Given values as observations", [each for each in tables if each])


def _cameras_section(pictures: dict[str, Drawing]) -> Section:
    parts = [pictures[name] for name in ("distortion", "correlations") if name in pictures]
    return Section("cameras", "Cameras", parts)


@np.errstate(all="ignore")
def _photos_section(result: AdjustedCollection, named: Iterable[int]) -> Section:
    given, count = result.collection, len(result.photo_parameters)
    used = result.used_images
    photos, residuals = given.image_photos[used], result.residuals[used]
    rms = np.sqrt(
        np.bincount(photos, (residuals**2).sum(axis=1), count) / np.bincount(photos, minlength=count) / 2
    )
    order = np.argsort(-np.nan_to_num(rms, nan=-1.0), kind="stable")
    weak = {int(each.photo): each.condition for each in weakest_photos(result)}
    rows, every = chosen_rows(count, [*weak, *named], [order])
    note = (
        ""
        if every
        else f"{len(rows)} of {count}: those that other tables name, those of the largest residuals,"
        " and the weakest."
    )
    units = [Column(name, unit, figures=6) for name, unit in zip(given.parameters, given.units, strict=True)]
    small = [Column(name, unit, figures=3) for name, unit in zip(given.parameters, given.units, strict=True)]
    values: list[Row] = [
        [Cell(str(row), id=f"photo-{row}"), *map(float, result.photo_parameters[row])]
        for row in rows.tolist()
    ]
    deviations: list[Row] = [[str(row), *map(float, result.photo_sd[row])] for row in rows.tolist()]
    fit: list[Row] = [
        [str(row), int(result.photo_images[row]), float(rms[row]), weak.get(row)] for row in rows.tolist()
    ]
    name = Column("Photo", text=True)
    tables = [
        Table("Parameters", [name, *units], values, note),
        Table("Standard deviations", [name, *small], deviations, note),
        Table(
            "Fit of images",
            [
                name,
                Column("Images", decimals=0),
                Column("rms of residuals", "px", decimals=3),
                Column("Condition of the pose", figures=3),
            ],
            fit,
            f"{note} {CONDITION_NOTE}".strip(),
        ),
    ]
    return Section("photos", "Photos", [Layers("photos-layers", tables)])


def _points_section(result: AdjustedCollection, named: Iterable[int]) -> Section:
    size = np.where(result.used_points, np.linalg.norm(result.point_sd, axis=1), np.nan)
    order = np.argsort(-np.nan_to_num(size, nan=-1.0), kind="stable")
    weak = {int(each.point): each.ratio for each in weakest_points(result)}
    rows, every = chosen_rows(len(size), [*weak, *named], [order])
    rows = rows[result.used_points[rows]]
    body: list[Row] = [
        [
            Cell(str(row), id=f"point-{row}"),
            int(result.point_rays[row]),
            *map(float, result.point_positions[row]),
            *map(float, result.point_sd[row]),
            weak.get(row),
        ]
        for row in rows.tolist()
    ]
    columns = [
        Column("Point", text=True),
        Column("Rays", decimals=0),
        *(Column(axis, figures=7) for axis in "XYZ"),
        *(Column(f"sd {axis}", figures=3) for axis in "XYZ"),
        Column("Largest over smallest sd", figures=3),
    ]
    few_of = (
        ""
        if every
        else f"{len(rows)} of {len(size)}: those that other tables name, those of the largest"
        " standard deviations, and the weakest. "
    )
    return Section("points", "Points", [Table("Points", columns, body, few_of + RATIO_NOTE)] if body else [])
