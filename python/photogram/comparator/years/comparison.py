"""Comparison of calibrations: histories of comparators, and common grids, with its document.

The compared values do not depend on the origin of the polynomials. Coefficients cannot be compared because
scales and cubic terms are correlated, and the frames of two calibrations differ. The whole correction is
decomposed into Legendre polynomials of x and of y, which are orthogonal in the range of all calibrations. The
first degree gives the scales and the lack of orthogonality, degrees two to four the remaining shape
(docs/comparator.md, Calibrations over years).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from photogram.arguments.objects import path_of
from photogram.arguments.types import Floats
from photogram.comparator.calibration import Calibration
from photogram.comparator.correction import Correction, partials_of
from photogram.comparator.fits import Frame, Polynomial
from photogram.comparator.grid import Grid, with_corrections
from photogram.comparator.tables import UM, XY, plate_points
from photogram.comparator.years.joint import RecordedCalibration, Together, adjust_together
from photogram.errors import InputError
from photogram.history.changes import History, dates_of, history
from photogram.history.document import history_document, history_findings
from photogram.lazy_dataclasses import dataclass
from photogram.show.methods import Documented, Judged
from photogram.show.page import Document, Fact, Section, about, significant
from photogram.show.quantity import Axis, Quantity, Table, members, of_each
from photogram.statistics.distributions import LEVEL
from photogram.statistics.findings import Findings, Tested
from photogram.words import Phrase, phrase

DEGREE = 4
NODES = 7  # per direction; a polynomial of fourth degree is decomposed
PPM = 1e6
ARCSEC = math.radians(1 / 3600)
PERCENT = 100.0
# The error of a comparator with a smaller estimate is insignificant, and its logarithm meaningless
LEAST_UM = 2e-3


def common_range(records: Sequence[RecordedCalibration]) -> Frame:
    identities = [each.correction.identity for each in records]
    low = np.max([each.low_um for each in identities if each], axis=0)
    high = np.min([each.high_um for each in identities if each], axis=0)
    if not (low < high).all():
        raise InputError(phrase("comparators.no-range", name=records[0].comparator))
    return Frame.of(np.array([low, high]))


def _apart(frame: Frame) -> tuple[Floats, Floats]:
    """Return nodes (n, 2) and their decomposition (9, n) into 1, P1..P4 of x, of y."""
    one = np.polynomial.legendre.leggauss(NODES)[0]
    x, y = (each.ravel() for each in np.meshgrid(one, one))
    of_x, of_y = (np.polynomial.legendre.legvander(each, DEGREE) for each in (x, y))
    basis = np.hstack([of_x, of_y[:, 1:]])
    nodes = np.array(frame.centre_um) + np.column_stack([x, y]) * np.array(frame.half_range_um)
    return nodes, np.linalg.pinv(basis)


def _figures(frame: Frame, bent: bool) -> tuple[Floats, tuple[str, ...], tuple[str, ...]]:
    """Return the values as linear forms of 18 coefficients, with names and units."""
    half_x, half_y = frame.half_range_um

    def at(term: int, axis: int) -> int:
        return 2 * term + axis

    # Terms: 0 is 1, 1 to 4 are P1 to P4 of x, 5 to 8 are P1 to P4 of y.
    rows = np.zeros((3, 18))
    rows[0, at(1, 0)] = PPM / half_x
    rows[1, at(5, 1)] = PPM / half_y
    rows[2, at(5, 0)], rows[2, at(1, 1)] = 1 / half_y / ARCSEC, 1 / half_x / ARCSEC
    names, units = ["scale x", "scale y", "lack of orthogonality"], ["um/m", "um/m", "arc seconds"]
    if bent:
        shapes = [(axis, along, degree) for axis in (0, 1) for along in (0, 1) for degree in (2, 3, 4)]
        more = [at(degree + 4 * along, axis) for axis, along, degree in shapes]
        names += [f"degree {degree} of {'xy'[axis]} along {'xy'[along]}" for axis, along, degree in shapes]
        rows, units = np.vstack([rows, np.eye(18)[more]]), units + ["um"] * len(shapes)
    return rows, tuple(names), tuple(units)


def _precision(records: Sequence[RecordedCalibration]) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Return centred logarithms of standard deviations, percent, and variances.

    The logarithm of a standard deviation with f degrees of freedom has the variance 1 / (2 f). The comparator
    variance is the variance of means minus the pointing part, and has the variances of both.
    """
    rows: dict[str, list[tuple[float, float]]] = {}
    if all(record.pointing_freedom > 0 and min(record.pointing_um) > 0 for record in records):
        for axis, name in enumerate("xy"):
            rows[f"pointing in {name}"] = [
                (record.pointing_um[axis], 0.5 / record.pointing_freedom) for record in records
            ]
    if all(record.random_um > LEAST_UM for record in records):
        rows["random comparator"] = []
        for record in records:
            counts = np.concatenate([case.counts for case in record.cases])
            pointing = float(np.mean(np.square(record.pointing_um)) * (1 / counts).mean())
            variance = 0.5 / record.freedom * (1 + pointing / record.random_um**2) ** 2
            rows["random comparator"].append((record.random_um, variance))
    pairs = np.array([*rows.values()]).reshape(-1, len(records), 2)
    logs, variances = np.log(pairs[..., 0]).T, pairs[..., 1].T
    return PERCENT * (logs - logs.mean(axis=0)), PERCENT**2 * variances, tuple(rows)


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Documented, Judged):
    """Comparison of calibrations over years.

    Attributes
    ----------
    calibrations
        Calibrations in order of date.
    histories
        History of every comparator with at least two calibrations, by name.
    ranges
        Compared range of readings of each comparator.
    together
        Joint adjustment of all readings.
    grids
        Plates by number, with coordinates and standard deviation from all calibrations.
    operators
        For each operator: standard deviations of a pointing in x and y (um), and degrees of freedom.
    """

    calibrations: tuple[RecordedCalibration, ...]
    histories: Mapping[str, History]
    ranges: Mapping[str, Frame]
    together: Together
    grids: Mapping[int, Grid]
    operators: Mapping[int, tuple[float, float, int]]

    @property
    def usable_grids(self) -> bool:
        """Whether the readings agree with the grids; otherwise the grids are withheld."""
        return self.together.test.problem() is None

    def corrections(self) -> list[Correction]:
        """Return the jointly adjusted corrections of all calibrations with covariances."""
        return _corrections(self.calibrations, self.together)

    def document(self) -> Document:
        """Return the document with changes, control charts, grids and all values."""
        together = self.together
        given = {plate: grid.sigma_um or 0.0 for plate, grid in together.grids.items()}
        grids = [
            members(grid, "points", "sigma_um", "adopted", plate="number")
            | {
                "given_um": together.grids[plate].xy_um,
                "corrections_um": together.corrections_um[plate],
                "covariance_um2": together.covariance_um2[plate],
                "usable": self.usable_grids,
            }
            for plate, grid in self.grids.items()
        ]
        pointing, plates = operators(self), []
        for plate, grid in self.grids.items():
            sd = np.sqrt(np.diag(together.covariance_um2[plate])).reshape(-1, 2)
            plates.append(plate_points(grid, grid.points, together.corrections_um[plate], sd))
        return history_document(
            "Calibrations of comparators over years",
            calibrations(self),
            self.histories,
            self.verdict,
            "comparators",
            {name: members(own, "centre_um", "half_range_um") for name, own in self.ranges.items()},
            highlights=[
                Fact.of(
                    f"Grid {plate}, a coordinate",
                    grid.sigma_um or 0.0,
                    "µm",
                    f"given {significant(given[plate], 3)} µm; {grid.adopted}",
                    figures=3,
                )
                for plate, grid in self.grids.items()
            ],
            more=[
                Section("grids", "Grids", plates, about("comparator.grids")),
                Section("pointing", "Pointing of the operators, all calibrations", [pointing]),
            ],
            members={
                "covariance": together.covariance,
                "sigma0": together.test.factor,
                "degrees_of_freedom": together.test.degrees_of_freedom,
                "grids": grids,
            },
        )

    def _findings(self) -> Findings:
        places = [
            (record.name, case.number, point, axis)
            for record in self.calibrations
            for case in record.cases
            for point in case.points.tolist()
            for axis in "xy"
        ]
        values = np.concatenate([own.ravel() for each in self.together.standardized for own in each])

        def name(index: tuple[int, ...]) -> Phrase:
            record, case, point, axis = places[index[0]]
            return phrase("comparators.axis-of-record", axis=axis, point=point, case=case, record=record)

        test = self.together.test
        wrong = test.problem() is not None
        return history_findings(
            self.histories,
            observations=[Tested(phrase("comparators.all-readings"), values, name, "w")],
            degrees_of_freedom=test.degrees_of_freedom,
            global_test=test,
            spoiled=phrase("harmful.grids") if wrong else "",
            if_usable=[phrase("advice.adjusted-grid")],
            if_withheld=[phrase("advice.grids-withheld" if wrong else "advice.comparator-changed")],
        )


def compare(
    calibrations: Sequence[Calibration | RecordedCalibration | Path | str], *, level: float = LEVEL
) -> Comparison:
    """Compare comparator calibrations over time, and adjust their plates jointly.

    Parameters
    ----------
    calibrations
        Calibrations, or their JSON documents (`photogram comparator --json`), in any order. Each requires a
        date and a joint adjustment.
    level
        Probability of a false detection of a change per comparator.

    Raises
    ------
    InputError
        If there are fewer than two calibrations, one without date or joint adjustment, or the same one twice.
        If plates of one number have other coordinates, or if ranges of readings do not overlap.
    AdjustmentError
        If the measurements do not determine the unknowns.
    """
    records: list[RecordedCalibration] = []
    for number, each in enumerate(calibrations, 1):
        if isinstance(each, Calibration):
            records.append(RecordedCalibration.of(each, f"calibration {number}"))
        elif isinstance(each, RecordedCalibration):
            records.append(each)
        else:
            records += RecordedCalibration.read(path_of(f"calibrations[{number - 1}]", each))
    if len(records) < 2:
        raise InputError(phrase("comparators.two", count=len(records)))
    records.sort(key=lambda record: record.day)
    for first, second in combinations(records, 2):
        if first.day == second.day and all(
            np.array_equal(case.means_um, other.means_um)
            for case, other in zip(first.cases, second.cases, strict=False)
        ):
            raise InputError(phrase("comparators.same", first=first.name, second=second.name))
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


def _corrections(records: Sequence[RecordedCalibration], together: Together) -> list[Correction]:
    found = []
    for k, record in enumerate(records):
        values, covariance = together.parameters[k], together.covariance[k, :, k, :]
        own = record.correction.polynomial
        polynomial = own and Polynomial(own.frame, values[3:].reshape(2, -1), own.scaled_cofactors)
        # Symmetric except for rounding.
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
    """Return the history of comparable values of one comparator over its common range."""
    mine, mine_corrections = [records[k] for k in own], [corrections[k] for k in own]
    bent = all(np.diag(each.covariance)[3:].any() for each in mine_corrections)
    taken, names, units = _figures(frame, bent)
    nodes, apart = _apart(frame)
    values, jacobians = [], []
    for each in mine_corrections:
        by_parameters, _ = partials_of(each, nodes)
        values.append(taken @ (apart @ (each.apply(nodes) - nodes)).ravel())
        by_terms = np.einsum("tn,nap->tap", apart, by_parameters)
        jacobians.append(taken @ by_terms.reshape(-1, by_parameters.shape[2]))
    j = np.array(jacobians)
    spread, variances, more = _precision(mine)
    k, m, count = len(mine), len(names), len(names) + len(more)
    covariance = np.zeros((k, count, k, count))
    of_parameters = together.covariance[own][:, :, own]
    covariance[:, :m, :, :m] = np.einsum("imp,ipjq,jnq->imjn", j, of_parameters, j)
    for column in range(len(more)):
        covariance[np.arange(k), m + column, np.arange(k), m + column] = variances[:, column]
    temperatures = [each.temperature_c for each in mine]
    known: dict[str, tuple[Floats, str]] = {}
    if None not in temperatures:
        known["temperature"] = (np.array(temperatures, dtype=float), "kelvin")
    dates = dates_of([each.day for each in mine], [each.name for each in mine])
    return history(
        np.column_stack([np.array(values), spread]),
        covariance,
        times=dates.years,
        occasions=dates.names,
        names=(*names, *more),
        units=(*units, *["percent"] * len(more)),
        unit_of_time="year",
        regressors=known,
        freedom=sum(each.freedom for each in records),
        level=level,
    )


def _certified(records: Sequence[RecordedCalibration], together: Together, plate: int) -> Grid:
    grid = together.grids[plate]
    days = [each.day.isoformat() for each in records if plate in each.grids]
    sigma = math.sqrt(float(np.diag(together.covariance_um2[plate]).mean()))
    when = f"{days[0]} to {days[-1]}, {len(days)} calibrations"
    return with_corrections(grid, grid.points, together.corrections_um[plate], sigma, when)


def _operators(records: Sequence[RecordedCalibration]) -> dict[int, tuple[float, float, int]]:
    sums: dict[int, Floats] = {}
    for record in records:
        for operator, (x, y, freedom) in record.operators.items():
            sums[operator] = sums.get(operator, np.zeros(3)) + freedom * np.array([x, y, 1.0])
    return {
        operator: (math.sqrt(x / freedom), math.sqrt(y / freedom), int(freedom))
        for operator, (x, y, freedom) in sorted((each, own.tolist()) for each, own in sums.items())
    }


def calibrations(comparison: Comparison) -> Table:
    found = comparison.calibrations
    plates = [", ".join(map(str, each.grids)) for each in found]
    celsius, squares = (Axis.of("", "°C"),), (Axis.of("", "um2"),)
    columns = [
        of_each(found, "name", kind="name", head="Calibration"),
        Quantity([each.day.isoformat() for each in found], kind="name", member="day", head="Day"),
        of_each(found, "comparator", kind="name", member="", head="Of"),
        Quantity(plates, kind="name", head="Plates"),
        Quantity([len(each.cases) for each in found], head="Cases"),
        of_each(found, "temperature_c", celsius, "value", member="", head="Temperature", decimals=1),
        of_each(found, "random_um", UM, "deviation", head="Random comparator", decimals=3),
        of_each(found, "freedom", member="degrees_of_freedom"),
        of_each(found, "pointing_um", XY, "deviation", head="Pointing {}", decimals=3),
        of_each(found, "pointing_covariance_um2", squares, "deviation", head="Covariance", decimals=3),
        of_each(found, "pointing_freedom", member="pointing_degrees_of_freedom"),
        Quantity([each.document() for each in comparison.corrections()], member="correction"),
    ]
    return Table("calibrations", "Calibrations", columns)


def operators(comparison: Comparison) -> Table:
    values = np.array([*comparison.operators.values()]).reshape(-1, 3)
    pointing, freedom = values[:, :2], values[:, 2].astype(int)
    head = "sd of a pointing in {}"
    columns = [
        Quantity([*comparison.operators], kind="name", member="operator", head="Operator"),
        Quantity(pointing, XY, "deviation", member="pointing_um", head=head, decimals=3),
        Quantity(freedom, member="degrees_of_freedom", head="Degrees of freedom"),
    ]
    return Table("operators", "Operators", columns)
