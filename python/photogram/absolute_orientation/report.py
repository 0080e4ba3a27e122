"""The listing of an orientation as text, and the eight prints of TB 19 under sense switches."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from photogram.absolute_orientation.cards import restart_record, transformation_records
from photogram.absolute_orientation.orientation import Orientation, Trace
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
from photogram.show.lines import Field, fact_lines, field, marks, padded, table_lines
from photogram.show.methods import report_of
from photogram.show.sections import Section, composed, headline, problems_or_none, verdict_sections


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
        *field(components, 0, "{name}", gap=" "),
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


def trace_text(result: Orientation) -> str:
    """Return what the cycles computed, under the bulletin's names and statement numbers."""
    rows = np.flatnonzero(result.took_part).tolist()
    names = [result.stations.ids[row] for row in rows]
    sections: list[Section] = []
    kappa, scale = float(result.initial.angles[2]), result.initial.scale
    for number, trace in enumerate(result.traces, 1):
        sections.append((f"Iteration {number}", _cycle(trace, names, kappa, scale)))
        kappa, scale = trace.parameters[2], trace.parameters[3]
    return composed(headline("absolute orientation", "prints under sense switches"), sections)


def _cycle(trace: Trace, names: list[str], kappa: float, scale: float) -> list[str]:
    places, rows = trace.equations
    normal, auxiliary = trace.normal, trace.auxiliary
    omega, phi, kappa_after, *others = trace.parameters
    stations = padded((names[station] for station, _ in places), 12)
    return [
        *_print(1, "after statement 2", "tan K", [[math.tan(kappa)]]),
        *_print(2, "before 10", "sin K, S", [[math.sin(kappa), scale]]),
        *_print(3, "after 8", "rotation matrix A", trace.rotation),
        f"sense switch 4, after 27: the eight P-values of {len(places)} equations",
        *(
            f"  {name} {'123'[axis]}" + _numbers(row)
            for name, (_, axis), row in zip(stations, places, rows.tolist(), strict=True)
        ),
        *_print(
            5,
            "after 29",
            "seven diagonal terms and last term of the normal equations",
            [[*np.diag(normal[:, :7]).tolist(), float(normal[6, 7])]],
        ),
        *_print(6, "after 33", "bottom row of the auxiliary table", [auxiliary[6].tolist()]),
        *_print(7, "after 35", "seven results of the back solution", [trace.results]),
        *_print(
            8,
            "after 36",
            "seven corrected parameters: omega, phi, K (rad), S, B",
            [[omega, phi, kappa_after, *others]],
        ),
    ]


def _print(switch: int, statement: str, what: str, rows: Iterable[Iterable[float]]) -> list[str]:
    return [f"sense switch {switch}, {statement}: {what}", *(f"  {'':<14}{_numbers(row)}" for row in rows)]


def _numbers(values: Iterable[float]) -> str:
    return "".join(f"{value:>18.9e}" for value in values)
