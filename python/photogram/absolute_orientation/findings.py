"""The tests that the verdict on an orientation rests on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.show.page import significant
from photogram.statistics.findings import Findings, Tested

if TYPE_CHECKING:
    from photogram import Orientation


def orientation_findings(result: Orientation) -> Findings:
    """Return the tests of an orientation: w with standard deviations to be relied on, else t."""

    def name(index: tuple[int, ...]) -> str:
        return f"{'XYZ'[index[1]]} of {result.stations.ids[index[0]]}"

    control = Tested("control", result.tested, name, "w")
    if not result.decided_by_w:
        control = Tested("control", result.tested, name, "t", second=max(result.degrees_of_freedom - 1, 1))
    if_usable = []
    if not result.weighted and result.degrees_of_freedom:
        if_usable.append(
            "Give standard deviations where they are known: the residuals are tested as a whole then."
        )
    if result.degrees_of_freedom == 0:
        if_usable.append("Seven known coordinates are just enough: one more makes errors visible.")
    if_usable += [
        f"Another orientation fits as well, with the scale {significant(each.scale, 6)}: only you know which"
        " is meant."
        for each in result.alternatives[:1]
    ]
    return Findings(
        status=result.status,
        observations=[control],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.test,
        untested="no standard deviations are given" if not result.weighted else "no degrees of freedom",
        scaled=result.unit_variance != "unity",
        hints=[str(message) for message in result.grave],
        take_out="`--reject ID` leaves the control of a station out; compare what it does to the others.",
        if_usable=if_usable,
    )
