"""The document of an adjusted block or collection: accuracy, process, messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Indices
from photogram.lazy_dataclasses import replace
from photogram.plots.accessor import drawings
from photogram.results import network_sections as sections
from photogram.results import network_tables as declared
from photogram.results.network import AdjustedNetwork
from photogram.results.tables import Tests
from photogram.show import quantity
from photogram.show.forms import unit_written
from photogram.show.judgement import remarks_section, verdict_document, verdict_table
from photogram.show.page import Document, Fact, Facts, Part, Section, about, significant
from photogram.show.quantity import Quantities, Quantity, for_people, members, records
from photogram.statistics.evidence import GLOBAL
from photogram.words import phrase

NOTABLE = 3.0  # Larger test values are counted
_NOT_CHECKED = 0.01
WORST = 25  # Observations in the table of the worst


def network_document(
    result: AdjustedNetwork,
    what: str,
    size: Section,
    given: Sequence[Section],
    *,
    photos: int,
    title: str = "",
    more: Sequence[Fact] = (),
    redundancy: Sequence[quantity.Table] = (),
    beside: Sequence[Section] = (),
    datum: str = "",
    poses: str = "",
    work: Sequence[Fact] = (),
    members: Callable[[], Mapping[str, Any]],
) -> Document:
    """Return the document of a network from its `photos`, `size` and `given` data.

    `more` are additional highlights, `redundancy` tables below the plot of redundancy numbers, `beside`
    sections below the plan. `datum` describes the reference of coordinates, `poses` the meaning of photo
    poses. `work` are other facts on the normal equations.
    `members` returns the members of JSON documents that are no tables.
    """
    pictures, tests = drawings(result), Tests(result)
    worst = tests.largest(WORST)
    weakest = sections.weakest_points(result), sections.weakest_photos(result)
    images_of_worst = worst[worst[:, 0] == 0, 1]
    worst_photos = result.given.image_photos[images_of_worst].tolist()
    worst_points = result.image_points[images_of_worst].tolist()
    for rows, table in zip((worst_points, worst_photos), weakest, strict=True):
        link = table.columns[0].link
        rows += [] if link is None else link.rows.tolist()
    history = declared.iteration_table(result.iterations)
    course_table = quantity.Table("iterations", "Iterations", history, about("iterations"))
    first = Fact.of("Weighted sum of squares at first", result.initial_weighted_sum_of_squares, figures=7)
    course = [Fact("Status", result.status), first]
    if result.loss is not None:
        course.append(Fact("Robust loss", about("loss", name=result.loss[0], scale=result.loss[1])))
    summary = result.reliability_summary
    reliability = [] if summary is None else summary.parts()
    return verdict_document(
        result.verdict,
        what,
        title,
        highlights=[*_highlights(result, photos), *more],
        sections=[
            remarks_section(problems_of(result)),
            Section("network", "Plan of the network", [pictures["network"]]),
            *beside,
            size,
            Section("residuals", "Image residuals", [pictures["residuals"]]),
            Section("redundancy", "Redundancy", [pictures["redundancy"], *redundancy], about("redundancy")),
            Section("reliability", "Reliability", reliability),
            Section("tests", "Tests", [pictures["tests"], verdict_table(result.verdict)], about("tests")),
            Section("worst", "Worst observations", [_worst_table(tests, worst)], about("worst")),
            *given,
            sections.photos_section(result, worst_photos, f"{datum} {poses}".strip()),
            sections.points_section(result, worst_points, datum),
            Section("weakest", "Weakest points and photos", weakest),
            Section("iterations", "Iterations", [course_table, Facts("Course", course)]),
        ],
        details=[
            Section("work", "Work", [Facts("Work", [*_work(result), *work])]),
            sections.images_section(result),
        ],
        members=members,
        phases=result.seconds,
    )


def problems_of(result: AdjustedNetwork) -> list[str]:
    """Return reasons against the use of values, the most serious first, and messages."""
    test = result.global_test
    problems = []
    if result.status != "converged":
        problems.append(str(phrase("problem.status", status=result.status)))
    if test is not None and (failed := test.problem()):
        problems.append(failed)
    problems += [str(message) for message in (*result.verdict.outliers, *result.messages)]
    if result.variance_of_unit_weight is None:
        problems.append(str(phrase("problem.no-redundancy")))
    return problems


def network_members(result: AdjustedNetwork, photo_members: Quantities = ()) -> dict[str, Any]:
    summary = result.reliability_summary
    of_photos = Quantity(result.photo_covariances, member="covariance")
    return {
        **members(result, "status", "degrees_of_freedom", "variance_of_unit_weight", "covariance_scale"),
        **members(result, "ordering", "predictions", "operations", "seconds"),
        "messages": [str(message) for message in result.messages],
        "loss": {"name": result.loss[0], "scale": result.loss[1]} if result.loss else None,
        "reliability": summary.document() if summary else None,
        "photos": records([*declared.photos(result), *photo_members, of_photos]),
        "stations": records(declared.stations(result)),
    }


def used_fact(name: str, used: Bools, code: str = "used") -> Fact:
    return Fact(name, about(code, n=np.count_nonzero(used), all=used.size))


def size_section(
    result: AdjustedNetwork, size: Sequence[Fact], good: Sequence[Fact], tables: Sequence[quantity.Table] = ()
) -> Section:
    terms, rows = result._terms, list[tuple[Any, ...]]()
    for what, axes, deviations in (
        ("points", terms.point_axes, result.point_sd[result.used_points]),
        ("photos", terms.photo_axes, result.photo_sd),
    ):
        for axis, column in zip(axes, deviations.T, strict=True):
            known = column[np.isfinite(column)] * axis.factor
            if known.size:
                rows.append((what, axis.name, *np.quantile(known, (0.5, 0.9, 1.0)), unit_written(axis.small)))
    heads = ("Standard deviations of", "Component", "Median", "90 % are below", "Largest", "Unit")
    columns = [
        Quantity(values, kind="number" if head in heads[2:5] else "name", head=head)
        for head, values in zip(heads, zip(*rows, strict=True) if rows else ((),) * 6, strict=True)
    ]
    parts: list[Part] = [
        Facts("Size", [*size, Fact.of("Degrees of freedom", result.degrees_of_freedom)]),
        Facts("Fit", [*good, *_images_facts(result)]),
        *tables,
        quantity.Table("precision", "Precision", columns, about("precision")),
    ]
    return Section("size", "Size and fit", parts)


def _highlights(result: AdjustedNetwork, photos: int) -> list[Fact]:
    used, (axis, _) = result.used_images, result._terms.image_axes
    images, points = np.count_nonzero(used), np.count_nonzero(result.used_points)
    variance, sigma = result.variance_of_unit_weight, math.nan
    note = about("expected.no-freedom")
    if variance is not None:
        sigma, note = math.sqrt(variance), ""
        for test in result.verdict.tests:
            if test.kind == GLOBAL and test.limits[0] is not None and test.limits[1] is not None:
                note = about("expected", low=math.sqrt(test.limits[0]), high=math.sqrt(test.limits[1]))
    found = [
        Fact.of("Standard deviation of unit weight", sigma, note=note, decimals=3),
        Fact("Photos", about("count", n=photos), note=about("photos", points=points, images=images)),
        Fact("Degrees of freedom", about("count", n=result.degrees_of_freedom)),
        Fact.of("Iterations", len(result.iterations), note=result.status),
    ]
    if images:
        rms = math.sqrt(float(((result.residuals[used] * axis.factor) ** 2).mean()))
        found.append(Fact.of("rms of image residuals", rms, unit_written(axis.small), figures=3))
    return found


def _images_facts(result: AdjustedNetwork) -> list[Fact]:
    used, (axis, _) = result.used_images, result._terms.image_axes
    unit, residuals = unit_written(axis.small), result.residuals[used] * axis.factor
    if not len(residuals):
        return []
    with np.errstate(over="ignore"):
        rms = np.sqrt((residuals**2).mean(axis=0))
        length = np.hypot(*residuals.T)
    lengths = float(np.median(length)), float(length.max())
    names = ("Residuals of images, rms in x and y", "Length of image residuals, median and largest")
    facts = [Fact.of(name, pair, unit, figures=3) for name, pair in zip(names, (rms, lengths), strict=True)]
    redundancy = result.redundancy[used]
    if np.isfinite(redundancy).all():
        least, note = (redundancy.mean(), redundancy.min()), about("redundancy-numbers")
        hidden, below = redundancy <= _NOT_CHECKED, about("redundancy-below", limit=_NOT_CHECKED)
        facts += [
            Fact.of("Redundancy numbers of images, mean and least", least, note=note, decimals=3),
            replace(used_fact("Image coordinates that nothing checks", hidden, "share"), note=below),
        ]
    return facts


def _work(result: AdjustedNetwork) -> list[Fact]:
    """Return the elimination order, and numbers of operations, also of other orders."""
    return [
        Fact("Photos eliminated", about(f"ordering.{result.ordering}")),
        Fact.of("Normal equations formed", result.formations, note="times"),
        *(
            Fact(
                f"Multiply-adds if eliminated {about(f'ordering.{name}')}",
                about("ordering.too-large") if math.isnan(count) else significant(count, 4),
            )
            for name, count in result.predictions.items()
            if name != result.ordering
        ),
        *(Fact.of(f"Multiply-adds of one {name}", n, figures=4) for name, n in result.operations.items()),
    ]


def _worst_table(tests: Tests, places: Indices) -> quantity.Table:
    names = []
    for kind, row, part in places.tolist():
        each = tests.components[kind]
        image = each.type == "image"
        names.append(f"image {each.axes[part].name}" if image else str(each.name((row, part))))
    count = sum(int(np.count_nonzero(np.abs(each.values) > NOTABLE)) for each in tests.components)
    note = about("worst-observations", n=len(places), count=count, limit=NOTABLE)
    columns = [Quantity(names, kind="name", head="Observation")]
    columns += [each for each in tests.columns(places) if each.name != "component"]
    return quantity.Table("worst", "Worst observations", for_people(columns), note)
