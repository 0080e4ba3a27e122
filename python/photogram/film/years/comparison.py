"""Calibrations of cameras compared: histories of each camera that was calibrated more than once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from photogram.errors import InputError
from photogram.film.certificate import Certificate
from photogram.film.years.dated import DatedCamera
from photogram.film.years.figures import figures_of
from photogram.lazy_dataclasses import dataclass
from photogram.messages import listed
from photogram.show.methods import Shown
from photogram.show.summary import Brief
from photogram.statistics.distributions import LEVEL
from photogram.statistics.history import History, dates_of, history

__all__ = ["CameraComparison", "compare_cameras"]


@dataclass(frozen=True, eq=False, repr=False)
class CameraComparison(Shown, Brief):
    """Cameras over years.

    Attributes
    ----------
    calibrations
        In the order of their days.
    histories
        Of every camera with two calibrations or more, by its name: `camera rc10-2345`.
    angles
        rad from the axis up to which each was compared.
    remarks
        What could not be compared, as sentences.
    """

    calibrations: tuple[DatedCamera, ...]
    histories: Mapping[str, History]
    angles: Mapping[str, float]
    remarks: tuple[str, ...]


def compare_cameras(
    calibrations: Sequence[Certificate | DatedCamera], *, angle: float | None = None, level: float = LEVEL
) -> CameraComparison:
    """Compare calibrations of one camera or of several over time.

    Parameters
    ----------
    calibrations
        Certificates with a date, or calibrated cameras with their days, in any order. The certificates of a
        camera get as many odd terms as the one that asks for most.
    angle
        rad from the axis up to which images are compared; the least to which those of a camera were
        calibrated when None.
    level
        Probability that a change is found in a camera where there is none.

    Raises
    ------
    InputError
        Fewer than two calibrations of a camera, one without date or covariance, or the same twice; cameras
        of several units; an angle that nothing says.
    """
    records = sorted(_dated(calibrations), key=lambda each: each.day)
    remarks: list[str] = []
    histories, angles = {}, {}
    for title in dict.fromkeys(each.camera.title for each in records):
        name, own = f"camera {title}", [each for each in records if each.camera.title == title]
        if len(own) < 2:
            remarks.append(f"{name} has one calibration only")
            continue
        _refuse_twice(own)
        angles[name] = _common_angle(own, name) if angle is None else angle
        histories[name], held = _history(own, angles[name], level)
        if held:
            remarks.append(f"{name}: not estimated by all, and so not compared: {listed(list(held))}")
    if not histories:
        raise InputError("a comparison needs two calibrations of a camera at least")
    return CameraComparison(tuple(records), histories, angles, tuple(remarks))


def _dated(calibrations: Sequence[Certificate | DatedCamera]) -> list[DatedCamera]:
    most: dict[str, int] = {}
    for each in calibrations:
        if isinstance(each, Certificate) and each.radial is not None:
            most[each.name] = max(most.get(each.name, 1), each.curve().terms)
    return [
        DatedCamera.of(each, None if each.radial is None else most[each.name])
        if isinstance(each, Certificate)
        else each
        for each in calibrations
    ]


def _refuse_twice(records: Sequence[DatedCamera]) -> None:
    for k, first in enumerate(records):
        for second in records[k + 1 :]:
            if first.day == second.day and first.camera.parameters == second.camera.parameters:
                raise InputError(f"{first.source} and {second.source} are the same calibration")


def _common_angle(records: Sequence[DatedCamera], name: str) -> float:
    known = [each.angle for each in records if each.angle is not None]
    if not known:
        raise InputError(f"nothing says up to which angle {name} was calibrated: give one")
    return min(known)


def _history(records: Sequence[DatedCamera], angle: float, level: float) -> tuple[History, tuple[str, ...]]:
    found = figures_of([each.camera for each in records], angle)
    dates = dates_of([each.day for each in records], [each.source for each in records])
    compared = history(
        found.values,
        found.covariances,
        times=np.array(dates.years),
        occasions=dates.names,
        names=found.names,
        units=found.units,
        unit_of_time="year",
        level=level,
    )
    return compared, found.held
