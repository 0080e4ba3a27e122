"""The page of a comparison of calibrations."""

from __future__ import annotations

import numpy as np

from photogram.comparator.years.comparison import Comparison
from photogram.show.history import control_charts, series_table, values_table
from photogram.show.judgement import judged, tests_section
from photogram.show.page import Column, Drawing, Fact, Page, Part, Row, Section, Table, significant
from photogram.show.ways import page_of

__all__ = ["comparison_page"]

UM = "µm"


@page_of.register(Comparison)
def comparison_page(comparison: Comparison) -> Page:
    """Return the report of a comparison for the browser."""
    histories = comparison.histories
    first, last = comparison.calibrations[0].day, comparison.calibrations[-1].day
    sections = [
        Section("charts", "Control charts", _charts(comparison), _CHARTS),
        Section("changes", "What changed", [series_table(own, name) for name, own in histories.items()]),
        Section("calibrations", "Calibrations", [_calibrations(comparison)]),
        Section("grids", "Grids", _grids(comparison), _GRIDS),
        Section("pointing", "Pointing of the operators, all calibrations", _operators(comparison)),
        Section("values", "All values", [values_table(own, name) for name, own in histories.items()]),
        tests_section(comparison.verdict),
    ]
    return Page(
        what="Calibrations of comparators over years",
        title=f"{len(comparison.calibrations)} calibrations, {first} to {last}",
        judgements=[judged(comparison.verdict)],
        advice=comparison.verdict.next,
        highlights=[
            Fact(
                f"Grid {plate}, a coordinate",
                significant(grid.sigma_um or 0.0, 3),
                UM,
                f"given {significant(comparison.together.grids[plate].sigma_um or 0.0, 3)} {UM}",
            )
            for plate, grid in comparison.grids.items()
        ],
        sections=sections,
    )


_CHARTS = (
    "Each value with its standard deviation; the line is the mean of all. Dashed: beyond, a value differs"
    " from all others, whose common errors are taken into account. Coloured: what was accepted as a change."
)
_GRIDS = (
    "Given coordinates and all readings of all calibrations in one adjustment, each calibration with a"
    " comparator of its own. Absolute scale and odd shapes that look alike in grid and comparator come from"
    " the given coordinates."
)


def _charts(comparison: Comparison) -> list[Part]:
    return [
        Drawing(
            f"charts-{k}",
            name,
            "",
            lambda own=own, name=name: control_charts(own, name[:1].upper() + name[1:]),  # type: ignore[misc]
        )
        for k, (name, own) in enumerate(comparison.histories.items())
    ]


def _calibrations(comparison: Comparison) -> Table:
    columns = (
        Column("Calibration", text=True),
        Column("Day", text=True),
        Column("Of", text=True),
        Column("Plates", text=True),
        Column("Cases"),
        Column("Temperature", "°C", decimals=1),
        Column("Random comparator", UM, decimals=3),
        Column("Pointing x", UM, decimals=3),
        Column("Pointing y", UM, decimals=3),
        Column("Covariance", "µm²", decimals=3),
    )
    rows: list[Row] = [
        [
            record.name,
            record.day.isoformat(),
            record.comparator,
            ", ".join(str(plate) for plate in record.grids),
            len(record.cases),
            record.temperature_c,
            record.random_um,
            *record.pointing_um,
            record.pointing_covariance_um2,
        ]
        for record in comparison.calibrations
    ]
    return Table("Calibrations", columns, rows)


def _grids(comparison: Comparison) -> list[Part]:
    columns = (
        Column("Point"),
        Column("X", UM, decimals=3),
        Column("Y", UM, decimals=3),
        Column("Correction of X", UM, decimals=3),
        Column("Correction of Y", UM, decimals=3),
        Column("sd X", UM, decimals=3),
        Column("sd Y", UM, decimals=3),
    )
    parts: list[Part] = []
    for plate, grid in comparison.grids.items():
        sd = np.sqrt(np.diag(comparison.together.covariance_um2[plate])).reshape(-1, 2)
        shift = comparison.together.corrections_um[plate]
        rows: list[Row] = [
            [int(point), *xy, *own, *deviations]
            for point, xy, own, deviations in zip(
                grid.points.tolist(), grid.xy_um.tolist(), shift.tolist(), sd.tolist(), strict=True
            )
        ]
        parts.append(Table(f"Grid {plate}, {grid.adopted}", columns, rows))
    return parts


def _operators(comparison: Comparison) -> list[Part]:
    columns = (
        Column("Operator", text=True),
        Column("sd of a pointing in x", UM, decimals=3),
        Column("in y", UM, decimals=3),
        Column("Degrees of freedom"),
    )
    rows: list[Row] = [[str(operator), *own] for operator, own in comparison.operators.items()]
    return [Table("Operators", columns, rows)] if rows else []
