"""The page of every adjusted network: how good it is, how it went, what was remarked."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.results.network import AdjustedNetwork
from photogram.results.network_tables import iterations, terms_of
from photogram.results.observation_rows import tested_singly
from photogram.results.page.observations import Worst, limit_of, worst_images, worst_of, worst_table
from photogram.results.page.pictures import drawings
from photogram.results.page.tables import photos_section, points_section
from photogram.results.report import ORDERINGS, problems_of
from photogram.show.cells import page_table, unit_written
from photogram.show.judgement import judged, remarks_section, verdict_table
from photogram.show.page import Column, Drawing, Fact, Facts, Page, Part, Row, Section, Table, significant
from photogram.statistics.findings import Tested

__all__ = [
    "network_page",
    "size_section",
]

_NOT_CHECKED = 0.01


def network_page(
    result: AdjustedNetwork,
    what: str,
    size: Section,
    given: Sequence[Section],
    *,
    photos: int,
    title: str = "",
    more: Sequence[Fact] = (),
    redundancy: Sequence[Table] = (),
    beside: Sequence[Section] = (),
    datum: str = "",
    poses: str = "",
) -> Page:
    """Return the page of a network.

    Parameters
    ----------
    result, what, title
        The network, and what it is called.
    size, given
        How much and how good it is, and the sections of what was given.
    photos, more
        The number of its photos, and what a reader wants first besides.
    redundancy
        Beside the picture of redundancy numbers.
    beside
        What stands beside the plan.
    datum, poses
        What coordinates refer to, and what the poses of photos are where that is not plain.
    """
    return Page(
        what=what,
        title=title,
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
        highlights=[*highlights(result, photos), *more],
        sections=_sections(result, size, given, redundancy, beside, (datum, poses)),
        phases=result.seconds,
    )


def _sections(
    result: AdjustedNetwork,
    size: Section,
    given: Sequence[Section],
    redundancy: Sequence[Table],
    beside: Sequence[Section],
    intro_of: tuple[str, str],
) -> list[Section]:
    pictures, groups = drawings(result), tested_singly(result)
    datum, poses = intro_of
    found = worst_of(groups)
    photos, points = worst_images(result, found)
    intro = (
        "The redundancy number of an observation is the share of its error that shows in its own"
        " residual; the rest"
        " goes into the unknowns. Their sum is the number of observations beyond what is needed."
    )
    return [
        Section("network", "Plan of the network", [pictures["network"]]),
        *beside,
        size,
        Section("residuals", "Image residuals", [pictures["residuals"]]),
        Section("redundancy", "Redundancy", [pictures["redundancy"], *redundancy], intro),
        tests_section(result, pictures["tests"]),
        worst_section(result, groups, found),
        *given,
        photos_section(result, photos, f"{datum} {poses}".strip()),
        points_section(result, points, datum),
        iterations_section(result),
        remarks_section(problems_of(result)),
    ]


def size_section(
    result: AdjustedNetwork, much: Sequence[tuple[str, str]], more: Sequence[Fact], good: Sequence[Fact]
) -> Section:
    """Return how much there is, `more` of it, and how good it is."""
    facts = [Fact(f"{name[:1].upper()}{name[1:]}", value) for name, value in much]
    facts.append(Fact("Degrees of freedom", f"{result.degrees_of_freedom:.8g}"))
    parts: list[Part] = [
        Facts("How much", [*facts, *more]),
        Facts("How good", [*good, *images_facts(result)]),
        *precision_table(result),
    ]
    return Section("size", "How much, how good", parts)


def highlights(result: AdjustedNetwork, photos: int) -> list[Fact]:
    """Return what a reader wants first of every network, with its number of photos."""
    used, (axis, _) = result.used_images, terms_of(result).image_axes
    images, points = np.count_nonzero(used), np.count_nonzero(result.used_points)
    found = [
        unit_weight(result),
        Fact("Photos", f"{photos:,}", note=f"{points:,} points, {images:,} images"),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom:,.0f}"),
    ]
    if images:
        rms = math.sqrt(float(((result.residuals[used] * axis.factor) ** 2).mean()))
        found.append(Fact("rms of image residuals", significant(rms, 3), unit_written(axis.small)))
    return found


def unit_weight(result: AdjustedNetwork) -> Fact:
    """Return the standard deviation of unit weight with what it may be."""
    variance, test = result.variance_of_unit_weight, findings_test(result)
    if variance is None:
        return Fact(
            "Standard deviation of unit weight",
            "–",
            note="no degrees of freedom: covariances are scaled by 1",
        )
    note = ""
    if test is not None:
        low, high = (math.sqrt(each) for each in test)
        note = f"{low:.3f} to {high:.3f} expected"
    return Fact("Standard deviation of unit weight", f"{math.sqrt(variance):.3f}", note=note)


def findings_test(result: AdjustedNetwork) -> tuple[float, float] | None:
    """Return the limits of the global test, None where none was made."""
    for test in result.verdict.tests:
        if test.name == "global" and test.limits[0] is not None and test.limits[1] is not None:
            return test.limits[0], test.limits[1]
    return None


def images_facts(result: AdjustedNetwork) -> list[Fact]:
    """Return how well images fit and are checked."""
    used, (axis, _) = result.used_images, terms_of(result).image_axes
    unit, residuals = unit_written(axis.small), result.residuals[used] * axis.factor
    if not len(residuals):
        return []
    with np.errstate(over="ignore"):
        rms = np.sqrt((residuals**2).mean(axis=0))
        length = np.hypot(*residuals.T)
    facts = [
        Fact(
            "Residuals of images, rms in x and y", f"{significant(rms[0], 3)}, {significant(rms[1], 3)}", unit
        ),
        Fact(
            "Length of image residuals, median and largest",
            f"{significant(float(np.median(length)), 3)}, {significant(float(length.max()), 3)}",
            unit,
        ),
    ]
    redundancy = result.redundancy[used]
    if np.isfinite(redundancy).all():
        hidden = int(np.count_nonzero(redundancy <= _NOT_CHECKED))
        facts.append(
            Fact(
                "Redundancy numbers of images, mean and least",
                f"{redundancy.mean():.3f}, {redundancy.min():.3f}",
                note="the share of an error that shows in its own residual: 0 not checked at all, 1 fully",
            )
        )
        facts.append(
            Fact(
                "Image coordinates that nothing checks",
                f"{hidden} of {redundancy.size}",
                note=f"redundancy below {_NOT_CHECKED:g}",
            )
        )
    return facts


def precision_table(result: AdjustedNetwork) -> list[Table]:
    """Return how the standard deviations of adjusted values are spread; none where none were computed."""
    terms, rows = terms_of(result), list[Row]()
    for what, axes, deviations in (
        ("points", terms.point_axes, result.point_sd[result.used_points]),
        ("photos", terms.photo_axes, result.photo_sd),
    ):
        for axis, column in zip(axes, deviations.T, strict=True):
            known = column[np.isfinite(column)] * axis.factor
            if known.size:
                figures = [float(each) for each in np.quantile(known, (0.5, 0.9, 1.0))]
                rows.append([what, axis.name, *figures, unit_written(axis.small)])
    columns = (
        Column("Standard deviations of", text=True),
        Column("Component", text=True),
        Column("Median", figures=3),
        Column("90 % are below", figures=3),
        Column("Largest", figures=3),
        Column("Unit", text=True),
    )
    note = "A posteriori: scaled by the unit variance where that is estimated."
    return [Table("Precision", columns, rows, note)] if rows else []


def tests_section(result: AdjustedNetwork, drawing: Drawing) -> Section:
    """Return all tests, and the picture of single ones."""
    table = verdict_table(result.verdict)
    parts: list[Part] = [drawing, *([table] if table.rows else [])]
    intro = "How the residuals agree with the standard deviations that were given, as a whole and one by one."
    return Section("tests", "Tests", parts, intro)


def worst_section(result: AdjustedNetwork, groups: Sequence[Tested], worst: Sequence[Worst]) -> Section:
    """Return the worst observations."""
    intro = (
        "A residual alone says little: an error shows in it only by the share of its redundancy number."
        " The test"
        " value takes both into account. Names of photos and points lead to their rows below."
    )
    parts = [worst_table(result, limit_of(groups), worst)] if worst else []
    return Section("worst", "Worst observations", parts, intro)


def iterations_section(result: AdjustedNetwork) -> Section:
    """Return the history."""
    facts = [
        Fact("Status", result.status),
        Fact("Photos eliminated", ORDERINGS.get(result.ordering, result.ordering)),
    ]
    if result.loss is not None:
        facts.append(Fact("Robust loss", f"{result.loss[0]}, from {result.loss[1]:g} standard deviations"))
    note = "Damping is 0 for a step of Gauss-Newton. The sum is that after the corrections of the iteration."
    table = page_table("Iterations", iterations(result), note)
    return Section("iterations", "Iterations", [table, Facts("Course", facts)])
