"""What a comparison shows: tables, verdict, document (docs/comparator.md lists it), text and page."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.comparator.tables import UM, XY
from photogram.comparator.years.comparison import Comparison
from photogram.io import json
from photogram.show.cells import page_table
from photogram.show.history import history_document, history_page, history_text
from photogram.show.lines import field
from photogram.show.methods import document_of, findings_of, page_of, report_of
from photogram.show.page import Document, Fact, Section, significant
from photogram.show.quantity import Axis, Quantity, of_each, records
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.history import changed_of, unchanged_of


def calibrations(comparison: Comparison) -> list[Quantity]:
    """Return the calibrations: names, days, what of, precision of comparator and pointings."""
    found = comparison.calibrations
    plates = [", ".join(map(str, each.grids)) for each in found]
    celsius, squares = (Axis.of("", "°C"),), (Axis.of("", "um2"),)
    return [
        of_each(found, "name", kind="name", head="Calibration"),
        Quantity([each.day.isoformat() for each in found], kind="name", member="day", head="Day"),
        of_each(found, "comparator", kind="name", member="", head="Of"),
        Quantity(plates, kind="name", head="Plates"),
        Quantity([len(each.cases) for each in found], head="Cases"),
        of_each(found, "temperature_c", celsius, "value", member="", head="Temperature", decimals=1),
        of_each(found, "random_um", UM, "deviation", head="Random comparator", decimals=3),
        of_each(found, "freedom", member="degrees_of_freedom"),
        of_each(found, "pointing_um", XY, "deviation", head="Pointing {}", decimals=3),
        of_each(found, "pointing_covariance_um2", squares, "deviation", head="Covariance", decimals=3),
        of_each(found, "pointing_freedom", member="pointing_degrees_of_freedom"),
    ]


def operators(comparison: Comparison) -> list[Quantity]:
    """Return the operators with the precision of their pointings in all calibrations."""
    values = np.array([*comparison.operators.values()]).reshape(-1, 3)
    pointing, freedom = values[:, :2], values[:, 2].astype(int)
    head = "sd of a pointing in {}"
    return [
        Quantity([*comparison.operators], kind="name", member="operator", head="Operator"),
        Quantity(pointing, XY, "deviation", member="pointing_um", head=head, decimals=3),
        Quantity(freedom, member="degrees_of_freedom", head="Degrees of freedom"),
    ]


def points(comparison: Comparison, plate: int) -> list[Quantity]:
    """Return the points of a plate with their corrections and standard deviations."""
    grid, together = comparison.grids[plate], comparison.together
    axes = tuple(Axis.of(name, "um") for name in "XY")
    sd = np.sqrt(np.diag(together.covariance_um2[plate])).reshape(-1, 2)
    return [
        Quantity(grid.points, head="Point"),
        Quantity(grid.xy_um, axes, "value", head="{}", decimals=3),
        Quantity(together.corrections_um[plate], axes, "deviation", head="Correction of {}", decimals=3),
        Quantity(sd, axes, "deviation", head="sd {}", decimals=3),
    ]


@findings_of.register(Comparison)
def comparison_findings(comparison: Comparison) -> Findings:
    """Return the tests of a comparison: of all readings, and of what should not have changed."""
    places = [
        (record.name, case.number, point, axis)
        for record in comparison.calibrations
        for case in record.cases
        for point in case.points.tolist()
        for axis in "xy"
    ]
    values = np.concatenate([own.ravel() for each in comparison.together.standardized for own in each])

    def name(index: tuple[int, ...]) -> str:
        record, case, point, axis = places[index[0]]
        return f"{axis} of point {point} of case {case} of {record}"

    test = comparison.together.test
    grid = "Give the next calibration the adjusted grid: `--grid grid-NUMBER.csv`."
    return Findings(
        status="converged",
        observations=[Tested("readings of the grids", values, name, "w")],
        degrees_of_freedom=test.degrees_of_freedom,
        global_test=test,
        spoiled="" if test.problem() is None else "readings do not agree with the grids and with each other",
        changed=changed_of(comparison.histories),
        systematic=[own.systematic(whose) for whose, own in comparison.histories.items()],
        remarks=unchanged_of(comparison.histories),
        if_usable=[grid],
        if_withheld=[
            "The grids are withheld: readings do not agree with them and with each other."
            if test.problem()
            else f"What changed is the comparator, not the grids. {grid}"
        ],
    )


@document_of.register(Comparison)
def comparison_document(comparison: Comparison) -> bytes:
    """Return everything as JSON."""
    together = comparison.together
    corrections = [Quantity([each.document() for each in comparison.corrections()], member="correction")]
    document = {
        "program": f"photogram {_photocore.__version__}",
        "verdict": comparison.verdict.document(),
        "calibrations": records([*calibrations(comparison), *corrections]),
        "covariance": together.covariance,
        "comparators": {
            name: {
                "centre_um": comparison.ranges[name].centre_um,
                "half_range_um": comparison.ranges[name].half_range_um,
                **history_document(own),
            }
            for name, own in comparison.histories.items()
        },
        "sigma0": together.test.factor,
        "degrees_of_freedom": together.test.degrees_of_freedom,
        "grids": [
            {
                "plate": plate,
                "points": grid.points,
                "given_um": together.grids[plate].xy_um,
                "corrections_um": together.corrections_um[plate],
                "covariance_um2": together.covariance_um2[plate],
                "sigma_um": grid.sigma_um,
                "adopted": grid.adopted,
                "usable": comparison.usable_grids,
            }
            for plate, grid in comparison.grids.items()
        ],
        "operators": records(operators(comparison)),
    }
    return json.to_json(document)


@report_of.register(Comparison)
def comparison_text(comparison: Comparison) -> str:
    """Return what a reader wants first, as text."""
    names, days, of, _, cases, _, random, _, pointing, *_ = calibrations(comparison)
    columns = [
        *field(names, max(18, *map(len, names.values)) + 2, head="calibration"),
        *field(days, 12, head="day"),
        *field(of, 16, head="of"),
        *field(cases, 6, ".0f", "cases"),
        *field(random, 9, ".3f", "random"),
        *field(pointing, 12, ".3f", "pointing {name}"),
    ]
    lines = [*history_text(columns, comparison.histories), ""]
    for plate, grid in comparison.grids.items():
        given = comparison.together.grids[plate].sigma_um or 0.0
        lines.append(f"grid {plate}: {given:.3f} um before, {grid.sigma_um:.3f} um after ({grid.adopted})")
    return "\n".join(lines) + "\n"


@page_of.register(Comparison)
def comparison_page(comparison: Comparison) -> Document:
    """Return the report of a comparison for the browser."""
    grids = [
        page_table(f"Grid {plate}, {grid.adopted}", points(comparison, plate))
        for plate, grid in comparison.grids.items()
    ]
    pointing = [page_table("Operators", operators(comparison))] if comparison.operators else []
    highlights = [
        Fact(
            f"Grid {plate}, a coordinate",
            significant(grid.sigma_um or 0.0, 3),
            "µm",
            f"given {significant(comparison.together.grids[plate].sigma_um or 0.0, 3)} µm",
        )
        for plate, grid in comparison.grids.items()
    ]
    return history_page(
        "Calibrations of comparators over years",
        calibrations(comparison),
        comparison.histories,
        comparison.verdict,
        highlights,
        more=[
            Section("grids", "Grids", grids, _GRIDS),
            Section("pointing", "Pointing of the operators, all calibrations", pointing),
        ],
    )


_GRIDS = (
    "Given coordinates and all readings of all calibrations in one adjustment, each calibration with a"
    " comparator of its own. Absolute scale and odd shapes that look alike in grid and comparator come from"
    " the given coordinates."
)
