"""The listing of an orientation as text: problems, then how good it is, then values with their deviations."""

from __future__ import annotations

import math

import numpy as np

from photogram.absolute_orientation.cards import restart_record, transformation_records
from photogram.absolute_orientation.orientation import Orientation
from photogram.absolute_orientation.tables import (
    cycles,
    facts,
    left_out,
    parameters,
    points,
    rotation,
    stations,
    tested_control,
)
from photogram.results.iteration_text import iteration_lines
from photogram.show.lines import Field, fact_lines, field, marks, table_lines
from photogram.show.methods import report_of
from photogram.show.sections import Section, composed, headline, problems_or_none, verdict_sections

__all__ = ["report", "summary"]


@report_of.register(Orientation)
def report(result: Orientation) -> str:
    """Return the listing of an orientation."""
    sections = [
        *summary(result),
        ("Residuals in the model: v = s A X + B - x", _model_residuals(result)),
        ("Rejected control: given minus transformed", _rejected(result)),
        ("Iterations", _iterations(result)),
        ("Points", _points(result)),
        ("Transformation, as part II reads it", transformation_records(result.similarity, "0")),
        ("Parameters, as a new solution starts from them", [restart_record(result.similarity, "0")]),
    ]
    return composed(headline("absolute orientation"), sections)


def summary(result: Orientation) -> list[Section]:
    """Return what a reader wants first, as titled sections, the verdict first."""
    much, good = facts(result)
    return [
        *verdict_sections(result.verdict),
        ("Problems", problems_or_none(result.problems, result.verdict)),
        ("Orientation", fact_lines([*much, *good])),
        ("Parameters: x = s A X + B", _parameters(result)),
        ("Control: residuals u = s X - A^T (x - B), known components", _control(result)),
    ]


def _parameters(result: Orientation) -> list[str]:
    names, values, sd, units = parameters(result)
    matrix = [Field("", [f"{name:<8}" for name in ("A", "", "")]), *field(rotation(result), 20, ".12f", "")]
    row = [*field(names, 8), *field(values, 20, ".12g", "value"), *field(sd, 16, ".4g", "sd")]
    return [*table_lines([*row, *field(units, 0, gap="  ")]), *table_lines(matrix)]


def _control(result: Orientation) -> list[str]:
    names, components, _, model, ground, redundancy, standardized, studentized = tested_control(result)
    tests = [("studentized", studentized), *([("standardized", standardized)] if result.weighted else [])]
    fields = [
        *field(names, 12, head="station"),
        *field(components, 1, "{name}", gap=" "),
        *field(model, 14, ".5g", gap=" "),
        *field(ground, 14, ".5g", gap=" "),
        *field(redundancy, 14, ".3f", "redundancy"),
        *(own for name, each in tests for own in field(each, 14, ".2f", name)),
        marks(standardized if result.decided_by_w else studentized, "  <--"),
    ]
    return [*table_lines(fields), _limit(result)]


def _limit(result: Orientation) -> str:
    if not math.isfinite(result.limit):
        return "no test: it takes two degrees of freedom"
    tests = int(np.isfinite(result.tested).sum())
    kind = (
        "standardized residual, normal distribution"
        if result.decided_by_w
        else f"studentized residual, Student with {result.degrees_of_freedom - 1} degrees of freedom"
    )
    return f"tested: {kind}; limit {result.limit:.2f} (5 percent for all {tests} tests together)"


def _model_residuals(result: Orientation) -> list[str]:
    names, _, _, residuals, *_ = stations(result)
    return table_lines([*field(names, 12, head="station"), *field(residuals, 16, ".5g", "v{name} {unit}")])


def _rejected(result: Orientation) -> list[str]:
    names, differences = left_out(result)
    return table_lines([*field(names, 12, head="station"), *field(differences, 16, ".5g", "d{name} {unit}")])


def _iterations(result: Orientation) -> list[str]:
    table = cycles(result)
    if result.cycles is None:
        return iteration_lines(table, ".6g")
    number, largest = table
    head = "largest correction of an angle, {unit}"
    return table_lines([*field(number, 6, ".0f", "cycle"), *field(largest, 36, ".3e", head, " ")])


def _points(result: Orientation) -> list[str]:
    names, positions, sd = points(result)
    return table_lines(
        [*field(names, 12, head="point"), *field(positions, 18, ".5f"), *field(sd, 11, ".5f", "sd {name}")]
    )
