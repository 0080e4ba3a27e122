"""The tests that the verdict on a calibration rests on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.joint import JointFit
from photogram.statistics.findings import Findings, Systematic, Tested
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.comparator import Calibration

FAR = 3.0  # a grid with larger differences, in standard deviations, is another grid


def comparator_findings(calibration: Calibration) -> Findings:
    """Return the tests of a calibration: readings have no standard deviation of their own, t decides."""
    screening = calibration.screening
    places = [
        (case.number, point, axis)
        for case in calibration.cases
        for point in case.placed.points.tolist()
        for axis in "xy"
    ]

    def name(index: tuple[int, ...]) -> Phrase:
        case, point, axis = places[index[0]]
        return phrase("comparators.axis", axis=axis, point=point, case=case)

    values, kind = np.vstack(screening.ratios).ravel(), phrase("comparators.readings")
    readings = Tested(kind, values, name, "t", second=max(screening.freedom - 1, 1))
    tests = calibration.pointing_tests
    rows = [(each.case, row, axis) for each in tests for row in range(len(each.ratios)) for axis in "xy"]

    def pointing(index: tuple[int, ...]) -> Phrase:
        case, row, axis = rows[index[0]]
        fields = {"axis": axis, "pointing": row + 1, "point": int(case.points[row]), "case": case.number}
        return phrase("comparators.pointing", **fields)

    ratios = np.concatenate([each.ratios.ravel() for each in tests])
    freedom = np.repeat([each.freedom for each in tests], [each.ratios.size for each in tests])
    pointings = Tested(
        phrase("comparators.pointings"), ratios, pointing, "t", second=np.maximum(freedom - 1.0, 1.0)
    )
    return Findings(
        status="converged",
        observations=[readings, pointings],
        degrees_of_freedom=screening.freedom,
        untested=phrase("untested.readings"),
        spoiled=phrase("harmful.comparator", change=screening.change_um, sd=screening.sigma_um)
        if screening.harmful
        else "",
        systematic=_grids(calibration.joint) if calibration.joint else [],
        if_usable=[phrase("advice.correct-measurements"), phrase("advice.keep-calibration")],
        if_withheld=[phrase("advice.correction-withheld")],
    )


def _grids(joint: JointFit) -> list[Systematic]:
    """Return the tests of the corrections of the plates against their standard deviations."""
    return [
        Systematic(
            kind=phrase("test.plate", plate=str(plate)),
            sentence=phrase("pattern.plate", plate=str(plate), factor=float(test.factor)),
            statistic="s^2",
            distribution="chi2/f",
            dof=(test.degrees_of_freedom,),
            value=test.variance,
            probability=test.probability_above,
            level=test.level / 2,
            large=test.factor > FAR,
        )
        for plate, result in joint.plates.items()
        if (test := result.test) is not None
    ]
