"""What the verdict on a resected photo rests on."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.results.observation_kinds import parts_of
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import Resection

UNKNOWNS = ("X", "Y", "Z", "omega", "phi", "kappa")


def resection_findings(result: Resection) -> Findings:
    """Return the tests of a resection: standard deviations are given, so the unit weight is known."""
    ids = result.point_ids

    def kind(
        what: Phrase, w: Floats, redundancy: Floats, name: Callable[[tuple[int, ...]], Phrase]
    ) -> Tested:
        return Tested(what, np.where(redundancy > TESTABLE, w, np.nan), name, "w")

    return Findings(
        status=result.status,
        observations=[
            kind(
                Phrase("test.image_coordinates"),
                result.standardized,
                result.redundancy,
                lambda index: parts_of(
                    "xy"[index[1]], Phrase("named.object_point", {"point": str(ids[index[0]])})
                ),
            ),
            kind(
                Phrase("test.components_of_control"),
                result.point_standardized,
                result.point_redundancy,
                lambda index: parts_of(
                    [UNKNOWNS[index[1]]], Phrase("named.control", {"point": str(ids[index[0]])})
                ),
            ),
            kind(
                Phrase("test.components_of_station"),
                result.pose_standardized,
                result.pose_redundancy,
                lambda index: parts_of([UNKNOWNS[index[0]]], Phrase("named.station")),
            ),
        ],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.global_test,
        untested=Phrase("untested.freedom"),
    )
