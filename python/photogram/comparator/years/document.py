"""Document and verdict of calibrations over years (JSON members: docs/comparator.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.tables import UM, XY, plate_points
from photogram.history.document import history_document, history_findings
from photogram.show.page import Document, Fact, Section, about, significant
from photogram.show.quantity import Axis, Quantity, Table, members, of_each
from photogram.statistics.findings import Findings, Tested
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.comparator.years import Comparison


def calibrations(comparison: Comparison) -> Table:
    found = comparison.calibrations
    plates = [", ".join(map(str, each.grids)) for each in found]
    celsius, squares = (Axis.of("", "°C"),), (Axis.of("", "um2"),)
    columns = [
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
        Quantity([each.document() for each in comparison.corrections()], member="correction"),
    ]
    return Table("calibrations", "Calibrations", columns)


def operators(comparison: Comparison) -> Table:
    values = np.array([*comparison.operators.values()]).reshape(-1, 3)
    pointing, freedom = values[:, :2], values[:, 2].astype(int)
    head = "sd of a pointing in {}"
    columns = [
        Quantity([*comparison.operators], kind="name", member="operator", head="Operator"),
        Quantity(pointing, XY, "deviation", member="pointing_um", head=head, decimals=3),
        Quantity(freedom, member="degrees_of_freedom", head="Degrees of freedom"),
    ]
    return Table("operators", "Operators", columns)


def comparison_findings(comparison: Comparison) -> Findings:
    places = [
        (record.name, case.number, point, axis)
        for record in comparison.calibrations
        for case in record.cases
        for point in case.points.tolist()
        for axis in "xy"
    ]
    values = np.concatenate([own.ravel() for each in comparison.together.standardized for own in each])

    def name(index: tuple[int, ...]) -> Phrase:
        record, case, point, axis = places[index[0]]
        return phrase("comparators.axis-of-record", axis=axis, point=point, case=case, record=record)

    test = comparison.together.test
    wrong = test.problem() is not None
    return history_findings(
        comparison.histories,
        observations=[Tested(phrase("comparators.all-readings"), values, name, "w")],
        degrees_of_freedom=test.degrees_of_freedom,
        global_test=test,
        spoiled=phrase("harmful.grids") if wrong else "",
        if_usable=[phrase("advice.adjusted-grid")],
        if_withheld=[phrase("advice.grids-withheld" if wrong else "advice.comparator-changed")],
    )


def comparison_document(comparison: Comparison) -> Document:
    together = comparison.together
    given = {plate: grid.sigma_um or 0.0 for plate, grid in together.grids.items()}
    grids = [
        members(grid, "points", "sigma_um", "adopted", plate="number")
        | {
            "given_um": together.grids[plate].xy_um,
            "corrections_um": together.corrections_um[plate],
            "covariance_um2": together.covariance_um2[plate],
            "usable": comparison.usable_grids,
        }
        for plate, grid in comparison.grids.items()
    ]
    pointing, plates = operators(comparison), []
    for plate, grid in comparison.grids.items():
        sd = np.sqrt(np.diag(together.covariance_um2[plate])).reshape(-1, 2)
        plates.append(plate_points(grid, grid.points, together.corrections_um[plate], sd))
    return history_document(
        "Calibrations of comparators over years",
        calibrations(comparison),
        comparison.histories,
        comparison.verdict,
        "comparators",
        {name: members(own, "centre_um", "half_range_um") for name, own in comparison.ranges.items()},
        highlights=[
            Fact.of(
                f"Grid {plate}, a coordinate",
                grid.sigma_um or 0.0,
                "µm",
                f"given {significant(given[plate], 3)} µm; {grid.adopted}",
                figures=3,
            )
            for plate, grid in comparison.grids.items()
        ],
        more=[
            Section("grids", "Grids", plates, about("comparator.grids")),
            Section("pointing", "Pointing of the operators, all calibrations", [pointing]),
        ],
        members={
            "covariance": together.covariance,
            "sigma0": together.test.factor,
            "degrees_of_freedom": together.test.degrees_of_freedom,
            "grids": grids,
        },
    )
