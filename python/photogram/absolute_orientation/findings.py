"""The tests that the verdict on an orientation rests on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.show.page import significant
from photogram.statistics.findings import Findings, Tested
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import Orientation


def orientation_findings(result: Orientation) -> Findings:
    """Return the tests of an orientation: w with standard deviations to be relied on, else t."""

    def name(index: tuple[int, ...]) -> Phrase:
        station, axis = result.stations.ids[index[0]], "XYZ"[index[1]]
        return Phrase("named.coordinate", {"axis": axis, "station": station})

    control = Tested("control", result.tested, name, "w")
    if not result.decided_by_w:
        control = Tested("control", result.tested, name, "t", second=max(result.degrees_of_freedom - 1, 1))
    if_usable = []
    if not result.weighted and result.degrees_of_freedom:
        if_usable.append(Phrase("advice.give-sd"))
    if result.degrees_of_freedom == 0:
        if_usable.append(Phrase("advice.spare-coordinate"))
    if_usable += [
        Phrase("advice.alternative", {"scale": significant(each.scale, 6)})
        for each in result.alternatives[:1]
    ]
    return Findings(
        status=result.status,
        observations=[control],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.test,
        untested=Phrase("untested.sd" if not result.weighted else "untested.freedom"),
        scaled=result.unit_variance != "unity",
        hints=[message.phrase or str(message) for message in result.grave],
        take_out=Phrase("advice.leave-station-out"),
        if_usable=if_usable,
    )
