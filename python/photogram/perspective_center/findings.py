"""What the verdict on the perspective centre of a projector rests on."""

from __future__ import annotations

import numpy as np

from photogram.perspective_center.solution import PerspectiveCenter
from photogram.show.methods import findings_of
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE

__all__ = ["projector_findings"]


@findings_of.register(PerspectiveCenter)
def projector_findings(result: PerspectiveCenter) -> Findings:
    """Return the tests of a projector: no standard deviation is given, residuals are tested by t."""

    def name(index: tuple[int, ...]) -> str:
        return f"{'XY'[index[1]]} of point {result.grid.ids[index[0]]}"

    values = np.where(result.redundancy >= TESTABLE, result.studentized, np.nan)
    freedom = result.degrees_of_freedom
    return Findings(
        status="converged" if result.converged else "not converged",
        observations=[Tested("readings of the grid", values, name, "t", second=max(freedom - 1, 1))],
        degrees_of_freedom=freedom,
        untested="no standard deviations are given",
    )
