"""The page of an adjusted collection of photos."""

from __future__ import annotations

import math

import numpy as np

from photogram.collection.adjusted import AdjustedCollection
from photogram.collection.findings import tested_observations
from photogram.collection.report import problems_of
from photogram.results.network_tables import control, points, stations
from photogram.results.page.observed import worst_images, worst_of
from photogram.results.page.parts import (
    images_facts,
    iterations_section,
    precision_table,
    tests_section,
    unit_weight,
    worst_section,
)
from photogram.results.page.pictures import drawings
from photogram.results.page.tables import observed_table, photos_section, points_section
from photogram.show.judgement import judged, remarks_section
from photogram.show.page import Drawing, Fact, Facts, Page, Part, Section, significant
from photogram.statistics.findings import by_t

__all__ = ["collection_page"]


@np.errstate(over="ignore", invalid="ignore")
def collection_page(result: AdjustedCollection) -> Page:
    """Return the report of an adjusted collection for the browser."""
    given = result.collection
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
        worst_section(result, groups, found),
        _weighted_section(result),
        _cameras_section(pictures),
        photos_section(result, given.image_photos[worst].tolist()),
        points_section(result, points(result), given.image_points[worst].tolist()),
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
        *images_facts(result),
    ]
    parts: list[Part] = [
        Facts("How much", facts),
        Facts("How good", good),
        *precision_table(result),
    ]
    return Section("size", "How much, how good", parts)


def _weighted_section(result: AdjustedCollection) -> Section:
    of_points, of_photos = "Weighted and fixed points", "Weighted and fixed parameters of photos"
    tables = [
        *observed_table(of_points, control(result), result.control, result.point_sd),
        *observed_table(of_photos, stations(result), result.stations, result.photo_sd),
    ]
    return Section("weighted", "Given values as observations", tables)


def _cameras_section(pictures: dict[str, Drawing]) -> Section:
    parts = [pictures[name] for name in ("distortion", "correlations") if name in pictures]
    return Section("cameras", "Cameras", parts)
