"""What the verdict on a resected photo rests on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogram.adjustment.resection import Resection
from photogram.arguments.types import Floats
from photogram.show.methods import findings_of
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE

UNKNOWNS = ("X", "Y", "Z", "omega", "phi", "kappa")


@findings_of.register(Resection)
def resection_findings(result: Resection) -> Findings:
    """Return the tests of a resection: standard deviations are given, so the unit weight is known."""
    ids = result.point_ids

    def kind(what: str, w: Floats, redundancy: Floats, name: Callable[[tuple[int, ...]], str]) -> Tested:
        return Tested(what, np.where(redundancy > TESTABLE, w, np.nan), name, "w")

    return Findings(
        status=result.status,
        observations=[
            kind(
                "image coordinates",
                result.standardized,
                result.redundancy,
                lambda index: f"{'xy'[index[1]]} of point {ids[index[0]]}",
            ),
            kind(
                "components of control",
                result.point_standardized,
                result.point_redundancy,
                lambda index: f"{UNKNOWNS[index[1]]} of control point {ids[index[0]]}",
            ),
            kind(
                "components of the station",
                result.pose_standardized,
                result.pose_redundancy,
                lambda index: f"{UNKNOWNS[index[0]]} of the station",
            ),
        ],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.global_test,
        untested="no degrees of freedom",
    )
