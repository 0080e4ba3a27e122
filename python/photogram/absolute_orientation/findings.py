"""What the verdict on an absolute orientation rests on."""

from __future__ import annotations

from photogram.absolute_orientation.orientation import Orientation
from photogram.show.ways import findings_of
from photogram.statistics.findings import Findings, Tested

__all__ = ["orientation_findings"]


@findings_of.register(Orientation)
def orientation_findings(result: Orientation) -> Findings:
    """Return the tests of an orientation: w with standard deviations to be relied on, else t."""

    def name(index: tuple[int, ...]) -> str:
        return f"{'XYZ'[index[1]]} of {result.stations.ids[index[0]]}"

    control = Tested("control", result.tested, name, "w")
    if not result.decided_by_w:
        control = Tested("control", result.tested, name, "t", second=max(result.degrees_of_freedom - 1, 1))
    return Findings(
        status=result.status,
        observations=[control],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.test,
        untested="no standard deviations are given" if not result.weighted else "no degrees of freedom",
        hints=[str(message) for message in result.grave],
    )
