"""Sections that every adjusted network has: how good it is, how it went, what was remarked."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.results.network import AdjustedNetwork
from photogram.results.network_tables import terms_of
from photogram.results.page.observed import Worst, limit_of, worst_table
from photogram.show.cells import unit_written
from photogram.show.judgement import verdict_table
from photogram.show.page import Column, Drawing, Fact, Facts, Part, Row, Section, Table, significant
from photogram.statistics.findings import Tested

__all__ = [
    "images_facts",
    "iterations_section",
    "precision_table",
    "tests_section",
    "unit_weight",
    "worst_section",
]

_NOT_CHECKED = 0.01


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


def tests_section(result: AdjustedNetwork, drawing: Drawing | None) -> Section:
    """Return all tests, and the picture of single ones."""
    table = verdict_table(result.verdict)
    parts: list[Part] = [*([drawing] if drawing else []), *([table] if table.rows else [])]
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
    columns = (
        Column("Iteration", decimals=0),
        Column("Weighted sum of squares", figures=7),
        Column("Largest change over sd", figures=3),
        Column("Damping", figures=2),
    )
    first: Row = [0, result.initial_weighted_sum_of_squares, None, None]
    rows: list[Row] = [
        first,
        *([i.number, i.weighted_sum_of_squares, i.largest_change, i.damping] for i in result.iterations),
    ]
    facts = [
        Fact("Status", result.status),
        Fact("Photos eliminated", _ORDERINGS.get(result.ordering, result.ordering)),
    ]
    if result.loss is not None:
        facts.append(Fact("Robust loss", f"{result.loss[0]}, from {result.loss[1]:g} standard deviations"))
    note = "Damping is 0 for a step of Gauss-Newton. The sum is that after the corrections of the iteration."
    return Section(
        "iterations", "Iterations", [Table("Iterations", columns, rows, note), Facts("Course", facts)]
    )


_ORDERINGS = {
    "input": "in input order",
    "rcm": "by reverse Cuthill-McKee",
    "amd": "by minimum degree",
    "dissection": "by nested dissection",
    "graph-dissection": "by dissection of the graph",
    "parts": "in parts, and the separators between them",
}
