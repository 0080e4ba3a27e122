"""The page of an absolute orientation."""

from __future__ import annotations

import math

import numpy as np

from photogram.absolute_orientation.orientation import Orientation
from photogram.absolute_orientation.plot import figure
from photogram.show.angles import ARCSEC
from photogram.show.judgement import judged, remarks_section, tests_section
from photogram.show.page import (
    Cell,
    Column,
    Drawing,
    Fact,
    Facts,
    Page,
    Part,
    Row,
    Section,
    Table,
    decimals_of,
    significant,
)
from photogram.show.ways import page_of

__all__ = ["orientation_page"]

AXES = "XYZ"
LISTED = 300
"""Transformed points that are listed at most."""


@page_of.register(Orientation)
def orientation_page(result: Orientation) -> Page:
    """Return the report of an orientation for the browser."""
    sections = [
        Section("residuals", "Residuals in plan", [_drawing(result)]),
        Section(
            "parameters", "Parameters", _parameters(result), "x = s A X + B, from the ground to the model."
        ),
        Section("control", "Control", [_control(result)], _tested(result)),
        Section("left-out", "Control that took no part", _left_out(result)),
        Section(
            "size", "How much, how good", [Facts("How much", _much(result)), Facts("How good", _good(result))]
        ),
        tests_section(result.verdict),
        Section("points", "Transformed points", _points(result)),
        Section("iterations", "Iterations", [_iterations(result)]),
        remarks_section(result.problems),
    ]
    return Page(
        what="Absolute orientation of a model",
        title="",
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
        highlights=_highlights(result),
        sections=sections,
    )


def _highlights(result: Orientation) -> list[Fact]:
    stations, ground = result.stations, result.rms / result.similarity.scale
    known = result.used.sum(axis=0)
    return [
        Fact(
            "rms of residuals on the ground",
            significant(ground, 3),
            stations.ground_unit,
            f"{significant(result.rms, 3)} {stations.model_unit} in the model",
        ),
        Fact(
            "Scale",
            significant(result.similarity.scale, 6),
            f"{stations.model_unit} / {stations.ground_unit}",
        ),
        Fact(
            "Known coordinates",
            f"{result.known}",
            note=", ".join(f"{count} {axis}" for axis, count in zip(AXES, known, strict=True)),
        ),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom}"),
    ]


def _drawing(result: Orientation) -> Drawing:
    caption = "The control in plan with its residuals, given minus transformed, enlarged as the scale says."
    return Drawing("picture-residuals", "Residuals of the control in plan", caption, lambda: figure(result))


def _parameters(result: Orientation) -> list[Part]:
    similarity, unit = result.similarity, result.stations.model_unit
    covariance = similarity.covariance
    sd = np.full(7, np.nan) if covariance is None else np.sqrt(np.diag(covariance))
    names = ("omega, °", "phi, °", "kappa, °", f"s, {unit} / {result.stations.ground_unit}")
    values = [*np.degrees(similarity.angles), similarity.scale, *similarity.translation]
    factors = [1.0 / ARCSEC] * 3 + [1.0] * 4
    units = ["″"] * 3 + [f"{unit} / {result.stations.ground_unit}"] + [unit] * 3
    rows: list[Row] = []
    for k, name in enumerate((*names, *(f"b{axis}, {unit}" for axis in "123"))):
        own = math.degrees(sd[k]) if k < 3 else float(sd[k])
        value = float(values[k])
        written = significant(value, 10) if not own > 0 else f"{value:.{decimals_of(np.array([own]))}f}"
        rows.append([name, Cell(written, sorts=value), float(sd[k]) * factors[k], units[k]])
    columns = (
        Column("Parameter", text=True),
        Column("Value"),
        Column("sd", figures=3),
        Column("Unit of sd", text=True),
    )
    matrix = Table(
        "Rotation matrix A",
        [Column(axis, decimals=10) for axis in AXES],
        [[float(value) for value in row] for row in similarity.rotation],
    )
    return [Table("Parameters", columns, rows), matrix]


def _control(result: Orientation) -> Table:
    ground, model = result.stations.ground_unit, result.stations.model_unit
    outliers, columns = set(result.outliers), [Column("Station", text=True), Column("Component", text=True)]
    columns += [
        Column("Residual", ground, figures=4),
        Column("Residual", model, figures=4),
        Column("Redundancy", decimals=3),
        Column("Test value " + ("w" if result.decided_by_w else "t"), decimals=2),
    ]
    rows: list[Row] = []
    for row, axis in np.argwhere(result.used).tolist():
        beyond = (row, axis) in outliers
        rows.append(
            [
                Cell(
                    result.stations.ids[row],
                    id="" if axis and result.used[row, :axis].any() else f"station-{row}",
                ),
                AXES[axis],
                float(result.residuals_ground[row, axis]),
                float(result.residuals[row, axis]),
                float(result.redundancy[row, axis]),
                Cell(float(result.tested[row, axis]), tone="look" if beyond else ""),
            ]
        )
    return Table("Control", columns, rows)


def _tested(result: Orientation) -> str:
    if not math.isfinite(result.limit):
        return "Given minus transformed. No single coordinate is tested: it takes two degrees of freedom."
    tests = int(np.isfinite(result.tested).sum())
    return (
        f"Given minus transformed, in the system of the ground. Beyond {result.limit:.2f} the test of a"
        f" coordinate rejects (5 percent for all {tests} together)."
    )


def _left_out(result: Orientation) -> list[Part]:
    left_out = result.stations.given & ~result.used
    rows: list[Row] = [
        [result.stations.ids[row], AXES[axis], float(result.differences[row, axis])]
        for row, axis in np.argwhere(left_out).tolist()
    ]
    columns = (
        Column("Station", text=True),
        Column("Component", text=True),
        Column("Given - transformed", result.stations.ground_unit, figures=4),
    )
    return [Table("Control that took no part", columns, rows)] if rows else []


def _much(result: Orientation) -> list[Fact]:
    starts = {
        "restart": "a former result",
        "report": "the first two stations",
        "closed-form": "the closed form",
    }
    done = len(result.iterations) if result.cycles is None else len(result.cycles)
    return [
        Fact("Stations that took part", f"{int(result.took_part.sum())} of {len(result.stations.ids)}"),
        Fact("Status", f"{result.status} after {done} iterations", note=f"method {result.method}"),
        Fact("Initial values", starts[result.started]),
    ]


def _good(result: Orientation) -> list[Fact]:
    sigma0 = "undefined" if result.sigma0 is None else significant(result.sigma0, 4)
    unit = "" if result.weighted or result.sigma0 is None else result.stations.model_unit
    return [
        Fact("Standard deviation of unit weight", sigma0, unit),
        Fact(
            "Condition number",
            f"{result.condition:.1f}",
            note="of the equations: rotations, relative scale, shifts",
        ),
    ]


def _points(result: Orientation) -> list[Part]:
    ids, positions, covariances = result.transform_points()
    if not ids:
        return []
    unit, sd = result.stations.ground_unit, np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    decimals = decimals_of(sd)
    columns = [
        Column("Point", text=True),
        *(Column(axis, unit, decimals=decimals) for axis in AXES),
        *(Column(f"sd {axis}", unit, figures=3) for axis in AXES),
    ]
    rows: list[Row] = [
        [name, *map(float, position), *map(float, deviations)]
        for name, position, deviations in zip(ids[:LISTED], positions, sd, strict=False)
    ]
    note = "" if len(ids) <= LISTED else f"The first {LISTED} of {len(ids)}."
    return [Table("Transformed points", columns, rows, note)]


def _iterations(result: Orientation) -> Table:
    if result.cycles is not None:
        columns = [Column("Cycle"), Column("Largest correction of an angle", "rad", figures=3)]
        return Table("Iterations", columns, [[k, value] for k, value in enumerate(result.cycles, 1)])
    columns = [
        Column("Iteration"),
        Column("Weighted sum of squares", figures=6),
        Column("Largest change over sd", figures=3),
        Column("Damping", figures=2),
    ]
    rows = [[i.number, i.weighted_sum_of_squares, i.largest_change, i.damping] for i in result.iterations]
    return Table("Iterations", columns, rows)
