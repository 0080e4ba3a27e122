"""The tests that the verdict on a calibration rests on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.joint import JointFit
from photogram.statistics.findings import Findings, Systematic, Tested
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.comparator import Calibration

FAR = 3.0  # A grid that differs from its values by so many times their standard deviation is another grid


def comparator_findings(calibration: Calibration) -> Findings:
    """Return the tests of a calibration: readings have no standard deviation of their own, t decides."""
    screening = calibration.screening
    places = [
        (case.number, point, axis)
        for case in calibration.cases
        for point in case.placed.points.tolist()
        for axis in "xy"
    ]

    def name(index: tuple[int, ...]) -> str:
        case, point, axis = places[index[0]]
        return f"{axis} of point {point} of case {case}"

    values = np.vstack(screening.ratios).ravel()
    readings = Tested("readings of the grid", values, name, "t", second=max(screening.freedom - 1, 1))
    tests = calibration.pointing_tests
    rows = [(each.case, row, axis) for each in tests for row in range(len(each.ratios)) for axis in "xy"]

    def pointing(index: tuple[int, ...]) -> str:
        case, row, axis = rows[index[0]]
        return f"{axis} of pointing {row + 1}, point {case.points[row]} of case {case.number}"

    ratios = np.concatenate([each.ratios.ravel() for each in tests])
    freedom = np.repeat([each.freedom for each in tests], [each.ratios.size for each in tests])
    pointings = Tested("pointings", ratios, pointing, "t", second=np.maximum(freedom - 1.0, 1.0))
    return Findings(
        status="converged",
        observations=[readings, pointings],
        degrees_of_freedom=screening.freedom,
        untested=Phrase("untested.readings"),
        spoiled=Phrase(
            "harmful.comparator",
            {"change": float(screening.change_um), "sd": float(screening.sigma_um)},
        )
        if screening.harmful
        else "",
        systematic=_grids(calibration.joint) if calibration.joint else [],
        if_usable=[Phrase("advice.correct-measurements"), Phrase("advice.keep-calibration")],
        if_withheld=[Phrase("advice.correction-withheld")],
    )


def _grids(joint: JointFit) -> list[Systematic]:
    """Return the tests of the corrections of the plates against their standard deviations."""
    return [
        Systematic(
            kind=Phrase("test.plate", {"plate": str(plate)}),
            sentence=Phrase("pattern.plate", {"plate": str(plate), "factor": float(own.test.factor)}),
            statistic="s^2",
            distribution="chi2/f",
            dof=(own.test.degrees_of_freedom,),
            value=own.test.variance,
            probability=own.test.probability_above,
            level=own.test.level / 2,
            large=own.test.factor > FAR,
        )
        for plate, own in joint.plates.items()
        if own.test is not None
    ]
