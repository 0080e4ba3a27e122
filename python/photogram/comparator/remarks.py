"""What a reader of a calibration should know before its values: problems, the gravest first, and remarks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from photogram.comparator.case import PlacedCase
from photogram.comparator.joint import JointFit
from photogram.comparator.outliers import FarPointing, Outlier, Screening
from photogram.comparator.readings import Session
from photogram.io.places import Place
from photogram.messages import Message

__all__ = ["plate_remarks", "problems"]

Found = TypeVar("Found", "FarPointing", "Outlier")

MOST = 40
"""Outliers of either kind that are named; the largest ones."""


def problems(
    session: Session,
    cases: Sequence[PlacedCase],
    screening: Screening,
    far: Sequence[FarPointing],
    joint: JointFit | None,
) -> list[Message]:
    """Return what keeps a reader from using the values, or should make them careful.

    A correction that outliers spoil, then grids that are worse than their standard deviations, then outliers
    one by one.
    """
    found = []
    if screening.harmful:
        found.append(
            Message(
                f"outliers change corrected coordinates by {screening.change_um:.1f} um (root mean square),"
                f" and a coordinate is uncertain by {screening.sigma_um:.3f} um: the correction is unusable"
            )
        )
    for plate, own in joint.plates.items() if joint else ():
        if own.test and (failed := own.test.problem()):
            text = f"plate {plate}, corrections against {own.sigma_um:.3f} um a priori: {failed}"
            found.append(Message(text))
    places = {
        (case.number, point): place
        for case in session.cases
        for point, place in zip(reversed(case.points.tolist()), reversed(case.places), strict=True)
    }
    found += _outliers(screening, cases, places)
    numbers = {case.number: case for case in session.cases}
    for pointing in _largest(far):
        found.append(numbers[pointing.case].places[pointing.row].message(_far(pointing)))
    return found + _more(len(far), "pointings")


def _outliers(
    screening: Screening, cases: Sequence[PlacedCase], places: Mapping[tuple[int, int], Place]
) -> list[Message]:
    """Name the outliers of the adjustment; a point that is off wherever it was measured only once."""
    plate_of = {case.number: case.case.plate for case in cases}
    measured: dict[tuple[int, int], list[int]] = {}
    for case in cases:
        for point in case.points.tolist():
            measured.setdefault((case.case.plate, point), []).append(case.number)
    off: dict[tuple[int, int], list[Outlier]] = {}
    for outlier in screening.outliers:
        off.setdefault((plate_of[outlier.case], outlier.point), []).append(outlier)
    everywhere = {
        key: own
        for key, own in sorted(off.items())
        if len(own) > 1 and [outlier.case for outlier in own] == measured[key]
    }
    found = [Message(_everywhere(plate, point, own)) for (plate, point), own in everywhere.items()]
    single = [own for own in screening.outliers if (plate_of[own.case], own.point) not in everywhere]
    found += [places[own.case, own.point].message(_outlier(own, screening.limit)) for own in _largest(single)]
    return found + _more(len(single), "points")


def _largest(found: Sequence[Found]) -> list[Found]:
    return sorted(found, key=lambda own: own.ratio, reverse=True)[:MOST]


def _more(count: int, what: str) -> list[Message]:
    return [Message(f"{count - MOST} more {what} are off")] if count > MOST else []


def _everywhere(plate: int, point: int, outliers: Sequence[Outlier]) -> str:
    head = f"plate {plate}, point {point}: off in every case in which it was measured: "
    instead = {outlier.instead for outlier in outliers}
    if len(instead) == 1 and None not in instead:
        return f"{head}it lies where point {instead.pop()} is expected: are labels exchanged?"
    return f"{head}are its grid coordinates wrong?"


def _outlier(outlier: Outlier, limit: float) -> str:
    head = (
        f"case {outlier.case}, point {outlier.point}: a residual of {outlier.distance_um:.1f} um,"
        f" {outlier.ratio:.3g} times its standard deviation (limit {limit:.2f})"
    )
    if outlier.instead is None:
        return f"{head}: a blunder?"
    return f"{head}: it lies where point {outlier.instead} is expected: are labels exchanged?"


def _far(pointing: FarPointing) -> str:
    return (
        f"case {pointing.case}, point {pointing.point}: a pointing is {abs(pointing.deviation_um):.1f} um"
        f" from the mean, {pointing.ratio:.3g} times its standard deviation: a blunder?"
    )


def plate_remarks(session: Session, cases: Sequence[PlacedCase]) -> list[Message]:
    """Remark on plates whose grid calibration is not valid, and on points that were not measured."""
    remarks = []
    for plate in dict.fromkeys(case.case.plate for case in cases):
        count = len(session.grids[plate].points)
        own = [case for case in cases if case.case.plate == plate]
        corners = [case.orientation.corner for case in own]
        complete = all(len(case.points) == count for case in own)
        if len({corners.count(corner) for corner in range(1, 5)}) > 1 or not complete:
            remarks.append(
                Message(
                    f"plate {plate}: GRID CALIBRATION CORRECTIONS ARE VALID ONLY IF ALL AVERAGE RESIDUALS"
                    " ARE COMPUTED FROM A MULTIPLE OF FOUR EXACTLY 90 DEGREE ROTATION CASES"
                )
            )
        missing = [count - len(case.points) for case in own]
        remarks += [
            Message(f"case {case.number}: {lacking} of {count} points of plate {plate} are missing")
            for case, lacking in zip(own, missing, strict=True)
            if lacking
        ]
    return remarks
