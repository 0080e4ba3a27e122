"""Calibrations compared: histories of comparators, and the grids that all of them measured."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.calibration import Calibration
from photogram.comparator.correction import Correction
from photogram.comparator.grid import Grid
from photogram.comparator.gridfile import corrected
from photogram.comparator.polynomial import Frame, Polynomial
from photogram.comparator.years.joint import Together, adjust_together
from photogram.comparator.years.quantities import common_range, quantities_of
from photogram.comparator.years.record import RecordedCalibration
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.show.methods import Shown
from photogram.show.summary import Brief
from photogram.statistics.distributions import LEVEL
from photogram.statistics.history import History, dates_of, history

__all__ = ["Comparison", "compare"]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Shown, Brief):
    """Calibrations over years.

    Attributes
    ----------
    calibrations
        In the order of their days.
    histories
        Of every comparator with two calibrations or more, by its name.
    ranges
        The range of readings over which each was compared.
    together
        The adjustment of all readings.
    grids
        The plates by their numbers, with the coordinates of all calibrations and their standard deviation.
    operators
        For each operator standard deviations of a pointing in x and y (um), and degrees of freedom.
    """

    calibrations: tuple[RecordedCalibration, ...]
    histories: Mapping[str, History]
    ranges: Mapping[str, Frame]
    together: Together
    grids: Mapping[int, Grid]
    operators: Mapping[int, tuple[float, float, int]]

    @property
    def usable_grids(self) -> bool:
        """Whether the readings agree with the grids: otherwise these are withheld."""
        return self.together.test.problem() is None

    def corrections(self) -> list[Correction]:
        """Return the corrections of all calibrations as adjusted together, with their covariances."""
        return _corrections(self.calibrations, self.together)


def compare(
    calibrations: Sequence[Calibration | RecordedCalibration | Path | str], *, level: float = LEVEL
) -> Comparison:
    """Compare calibrations of one comparator or of several over time, and adjust their plates together.

    Parameters
    ----------
    calibrations
        Calibrations, or JSON documents of them (`photogram comparator --json`), in any order; each has a date
        and a joint adjustment.
    level
        Probability that a change is found in a comparator where there is none.

    Raises
    ------
    InputError
        Fewer than two calibrations, one without date or joint adjustment, or the same twice; plates of one
        number with other coordinates; ranges of readings that have nothing in common.
    AdjustmentError
        The measurements do not determine the unknowns.
    """
    records: list[RecordedCalibration] = []
    for place, each in enumerate(calibrations, 1):
        if isinstance(each, Calibration):
            records.append(RecordedCalibration.of(each, f"calibration {place}"))
        else:
            records += (
                [each] if isinstance(each, RecordedCalibration) else RecordedCalibration.read(Path(each))
            )
    if len(records) < 2:
        raise InputError("a comparison needs two calibrations at least")
    records.sort(key=lambda each: each.day)
    _refuse_twice(records)
    together = adjust_together(records)
    corrections = _corrections(records, together)
    histories, ranges = {}, {}
    for name in dict.fromkeys(each.comparator for each in records):
        own = [k for k, each in enumerate(records) if each.comparator == name]
        if len(own) > 1:
            ranges[name] = common_range([records[k] for k in own])
            histories[name] = _history(records, own, corrections, together, ranges[name], level)
    return Comparison(
        calibrations=tuple(records),
        histories=histories,
        ranges=ranges,
        together=together,
        grids={plate: _certified(records, together, plate) for plate in together.grids},
        operators=_operators(records),
    )


def _refuse_twice(records: Sequence[RecordedCalibration]) -> None:
    for k, first in enumerate(records):
        for second in records[k + 1 :]:
            if first.day == second.day and all(
                own.means_um.shape == other.means_um.shape and (own.means_um == other.means_um).all()
                for own, other in zip(first.cases, second.cases, strict=False)
            ):
                raise InputError(f"{first.name} and {second.name} are the same calibration")


def _corrections(records: Sequence[RecordedCalibration], together: Together) -> list[Correction]:
    found = []
    for k, record in enumerate(records):
        values, covariance = together.parameters[k], together.covariance[k, :, k, :]
        own = record.correction.polynomial
        polynomial = own and Polynomial(own.frame, values[3:].reshape(2, -1), own.scaled_cofactors)
        # Symmetric but for rounding.
        even = (covariance + covariance.T) / 2
        scale_x, scale_y, lean = values[:3].tolist()
        found.append(Correction(scale_x, scale_y, lean, polynomial, even, record.correction.identity))
    return found


def _history(
    records: Sequence[RecordedCalibration],
    own: Sequence[int],
    corrections: Sequence[Correction],
    together: Together,
    frame: Frame,
    level: float,
) -> History:
    """Compare the calibrations of one comparator."""
    mine = [records[k] for k in own]
    covariance = together.covariance[own][:, :, own]
    found = quantities_of(mine, [corrections[k] for k in own], covariance, frame)
    temperatures = [each.temperature_c for each in mine]
    known: dict[str, tuple[Floats, str]] = {}
    if None not in temperatures:
        known["temperature"] = (np.array(temperatures, dtype=float), "kelvin")
    dates = dates_of([each.day for each in mine], [each.name for each in mine])
    return history(
        found.values,
        found.covariance,
        times=dates.years,
        occasions=dates.names,
        names=found.names,
        units=found.units,
        unit_of_time="year",
        regressors=known,
        freedom=sum(each.freedom for each in records),
        level=level,
    )


def _certified(records: Sequence[RecordedCalibration], together: Together, plate: int) -> Grid:
    """Return a plate as all calibrations have it."""
    grid = together.grids[plate]
    days = [each.day.isoformat() for each in records if plate in each.grids]
    sigma = math.sqrt(float(np.diag(together.covariance_um2[plate]).mean()))
    when = f"{days[0]} to {days[-1]}, {len(days)} calibrations"
    return corrected(grid, grid.points, together.corrections_um[plate], sigma, when)


def _operators(records: Sequence[RecordedCalibration]) -> dict[int, tuple[float, float, int]]:
    """Pool the variances of pointings of each operator over all calibrations."""
    sums: dict[int, Floats] = {}
    for record in records:
        for operator, (x, y, freedom) in record.operators.items():
            sums[operator] = sums.get(operator, np.zeros(3)) + freedom * np.array([x, y, 1.0])
    return {
        operator: (math.sqrt(x / freedom), math.sqrt(y / freedom), int(freedom))
        for operator, (x, y, freedom) in sorted((each, own.tolist()) for each, own in sums.items())
    }
