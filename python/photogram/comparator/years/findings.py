"""What the verdict on a comparison rests on."""

from __future__ import annotations

import numpy as np

from photogram.comparator.years.comparison import Comparison
from photogram.show.methods import findings_of
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.history import changed_of, unchanged_of

__all__ = ["comparison_findings"]


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
