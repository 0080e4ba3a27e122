"""The report of an adjusted collection: problems, how good it is, values with their deviations."""

from __future__ import annotations

import math

import numpy as np

from photogram.collection.result import AdjustedCollection
from photogram.results.iteration_text import iteration_lines
from photogram.results.network_tables import control, iterations, photos, stations
from photogram.results.observation_rows import image_lines, largest, observed_lines
from photogram.results.report import (
    first_sections,
    predicted_operations,
    reliability_lines,
    suspects_section,
)
from photogram.results.weakest import weakest_lines
from photogram.show.lines import Field, field, table_lines
from photogram.show.methods import report_of
from photogram.show.sections import Section, composed, headline


@report_of.register(AdjustedCollection)
def report(result: AdjustedCollection) -> str:
    """Return the report of an adjusted collection."""
    sections = [
        *summary(result),
        ("Reliability", reliability_lines(result, "")),
        ("Iterations", iteration_lines(iterations(result), ".6f")),
        (
            "Weighted and fixed points: adjusted minus given, redundancy, standardized difference",
            observed_lines(control(result), "point"),
        ),
        (
            "Weighted and fixed parameters: adjusted minus given, redundancy, standardized difference",
            observed_lines(stations(result), "photo"),
        ),
        ("Photos: values and standard deviations", _photos(result)),
        ("Points: standard deviations", _points(result)),
        ("Weakest points and photos", weakest_lines(result)),
        ("Image points: observed minus computed, redundancy, standardized residual", image_lines(result)),
        ("Work", _work(result)),
    ]
    return composed(headline("collection of photos"), sections)


def summary(result: AdjustedCollection) -> list[Section]:
    """Return what a reader wants first, as titled sections: verdict, problems, adjustment, suspects."""
    return [*first_sections(result, _adjustment(result)), suspects_section(result)]


def _adjustment(result: AdjustedCollection) -> list[str]:
    variance, residuals = result.variance_of_unit_weight, result.residuals[result.used_images]
    rows = [
        ("status", result.status),
        ("iterations", f"{len(result.iterations)}"),
        ("cost at first (half the sum)", f"{0.5 * result.initial_weighted_sum_of_squares:.6e}"),
        ("cost", f"{result.cost:.6e}"),
        (
            "minimised",
            f"{result.loss[0]} loss, scale {result.loss[1]:g}" if result.loss else "sum of squares",
        ),
        (
            "standard deviation of unit weight",
            f"{math.sqrt(variance):.6f}" if variance is not None else "undefined",
        ),
        ("degrees of freedom", f"{result.degrees_of_freedom}"),
        *size_of(result),
        ("rms of residuals, px", ", ".join(f"{value:.4f}" for value in np.sqrt((residuals**2).mean(axis=0)))),
        ("median length of residuals, px", f"{np.median(np.hypot(*residuals.T)):.4f}"),
    ]
    return [f"{name:<36}{value}" for name, value in rows]


def size_of(result: AdjustedCollection) -> list[tuple[str, str]]:
    """Return what the collection consists of: names and what there is."""
    counts = {
        "photos": result.photo_images > 0,
        "points": result.used_points,
        "image points": result.used_images,
    }
    return [(name, f"{np.count_nonzero(used)} used of {len(used)}") for name, used in counts.items()]


def _photos(result: AdjustedCollection) -> list[str]:
    """List the photos; of very many those whose translations are the least certain."""
    sizes = np.linalg.norm(result.photo_sd[:, 3:6], axis=1)
    (own, count, values, sd), more = largest(photos(result), sizes, "standard deviations")
    (named,), (counts,) = field(own, 10, head="photo"), field(count, 6, ".0f", "images")
    rows = [[named, counts, *field(values, 14, ".6g")]]
    if np.isfinite(sd.values).any():
        label = Field("", [f"{'sd':<{len(named.head) + len(counts.head)}}"] * len(named.texts))
        rows.append([label, *field(sd, 14, ".2g", "")])
    return [*table_lines(*rows), *more]


def _points(result: AdjustedCollection) -> list[str]:
    """Say how the standard deviations are spread; the JSON document has every one."""
    deviations = result.point_sd[np.isfinite(result.point_sd).all(axis=1)]
    if not len(deviations):
        return []
    lines = [f"{'':<12}{'median':>12}{'90 percent':>12}{'largest':>12}"]
    for axis, name in enumerate("XYZ"):
        figures = [*np.quantile(deviations[:, axis], (0.5, 0.9)), deviations[:, axis].max()]
        lines.append(f"{name:<12}" + "".join(f"{figure:12.4g}" for figure in figures))
    return lines


def _work(result: AdjustedCollection) -> list[str]:
    tried = ", ".join(
        f"{name} {predicted_operations(operations, '.2g')}" for name, operations in result.predictions.items()
    )
    return [
        f"ordering                            {result.ordering} (multiply-adds predicted: {tried})",
        f"formations of the normal equations  {result.formations}",
    ]
