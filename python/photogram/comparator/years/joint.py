"""Records of calibrations, and their joint adjustment with separate comparators and common plates.

Linear about the joint adjustments of the calibrations. A reading x of the grid point g (plate, in the
handedness of the comparator) has the residual

    v = -(M J)^-1 (M Q dp + M' C dtheta + dT - dg + w),   w = M C(x) + T - g.

C is the corrected reading with the partials J by the reading and Q by the parameters p. M is the rotation and
T the translation of the case. Parameters and cases of a calibration are eliminated. The result are normal
equations of grid corrections, to which given coordinates add 1 / sigma^2. The covariance of the parameters
contains the remaining errors common to several calibrations.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from photogram.arguments.fields import Checked
from photogram.arguments.types import Floats, Indices
from photogram.comparator.calibration import Calibration
from photogram.comparator.case import exchanged
from photogram.comparator.correction import PARAMETERS, Correction, parameters_of, partials_of
from photogram.comparator.fits import rotation_matrix
from photogram.comparator.grid import Grid
from photogram.errors import AdjustmentError, InputError
from photogram.io import json
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.memory import require
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import phrase

ISO = re.compile(r"(\d{4})-(\d{1,2})-(\d{1,2})$")
OF_THE_REPORT = re.compile(r"(\d{1,2})/(\d{1,2})/(\d{2}|\d{4})$")
_WHAT = "calibration of a comparator"
FIRST_YEAR = 50  # Two-digit years from this one on are in the 20th century, earlier ones in the 21st


@dataclass(frozen=True, eq=False)
class RecordedCase(Checked):
    """Mean readings of a case, and the plate orientation.

    Attributes
    ----------
    number, operator, plate, left_handed
        Numbers and handedness of the case.
    points, counts
        (n,) grid points, and number of readings of each.
    means_um
        (n, 2) mean readings.
    rotation_rad, translation_um
        grid = M(rotation) corrected + translation, from the joint adjustment.
    """

    number: int
    operator: int
    plate: int
    left_handed: bool
    points: Indices
    counts: Indices
    means_um: Floats
    rotation_rad: float
    translation_um: Floats

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.means_um.shape != (len(self.points), 2):
            name = phrase("comparators.case", case=self.number)
            shape = str(self.means_um.shape)
            wrong = phrase("comparators.grid-shape", count=len(self.points), shape=shape)
            raise InputError(phrase("error.at", what=name, message=wrong))


@dataclass(frozen=True, eq=False)
class RecordedCalibration(Checked):
    """Calibration record with measurements and joint correction.

    Attributes
    ----------
    name
        Name of its file, or its index among the calibrations.
    day
        Date of the measurement.
    correction
        Correction of the joint adjustment, with its identity.
    random_um, freedom
        Standard deviation of the comparator, degrees of freedom of the joint adjustment.
    pointing_um, pointing_covariance_um2, pointing_freedom
        Standard deviations of a pointing in x and y, their covariance, degrees of freedom.
    operators
        For each operator: variances of a pointing in x and y (um^2), and their degrees of freedom.
    cases
        The cases.
    grids
        Plates with given coordinates of measured points.
    """

    name: str
    day: date
    correction: Correction
    random_um: float = field(metadata={"low": 0, "open": True})
    freedom: int = field(metadata={"low": 1, "open": False})
    pointing_um: tuple[float, float]
    pointing_covariance_um2: float
    pointing_freedom: int
    operators: Mapping[int, tuple[float, float, int]]
    cases: tuple[RecordedCase, ...]
    grids: Mapping[int, Grid]

    @property
    def comparator(self) -> str:
        """Name of the comparator."""
        identity = self.correction.identity
        assert identity is not None
        return f"comparator {identity.comparator}{', second stage' if identity.secondary else ''}"

    @property
    def temperature_c(self) -> float | None:
        """Temperature of the plates."""
        return self.correction.identity.temperature_c if self.correction.identity else None

    @classmethod
    def read(cls, path: Path) -> list[RecordedCalibration]:
        """Read one or several calibrations from a file of `photogram comparator --json`.

        Raises
        ------
        InputError
            If the file cannot be read or does not contain a calibration. If a calibration was withheld, or if
            it has neither joint adjustment nor date.
        """
        with json.holding(_WHAT, path):
            found = json.read_json(path).value
            many = found if isinstance(found, list) else [found]
            names = [path.stem] if len(many) == 1 else [f"{path.stem}-{k + 1}" for k in range(len(many))]
            return [_from_document(each, name) for each, name in zip(many, names, strict=True)]

    @classmethod
    def of(cls, calibration: Calibration, name: str) -> RecordedCalibration:
        """Return the record of a calibration."""
        return _from_document(orjson.loads(calibration.to_json()), name)


def day_of(text: str) -> date:
    """Return the date of a text: 1972-07-17, or 7/17/72 as in the report."""
    year = month = day = 0
    if match := ISO.match(text.strip()):
        year, month, day = map(int, match.groups())
    elif match := OF_THE_REPORT.match(text.strip()):
        month, day, year = map(int, match.groups())
        if len(match[3]) == 2:
            year += 1900 if year >= FIRST_YEAR else 2000
    try:
        return date(year, month, day)
    except ValueError:
        raise InputError(phrase("comparators.date", date=text)) from None


def _from_document(document: Any, name: str) -> RecordedCalibration:
    if document.get("usable") is False:
        raise InputError(phrase("comparators.withheld"))
    joint = document["joint"]
    if joint is None or joint["correction"] is None:
        raise InputError(phrase("comparators.no-joint"))
    correction = Correction.from_document(joint["correction"])
    if correction.identity is None:
        raise InputError(phrase("comparators.no-identity"))
    counts = {(each["case"], each["point"]): each["readings"] for each in document["pointing"]["points"]}
    total = document["pointing"]["total"]
    freedom = total["degrees_of_freedom"]
    placed = {each["case"]: each for each in joint["cases"]}
    grids = {
        plate["plate"]: _grid(plate, own)
        for plate, own in zip(document["plates"], joint["plates"], strict=True)
    }
    cases = tuple(
        RecordedCase(
            number=each["case"],
            **{name: each[name] for name in ("operator", "plate", "left_handed", "points", "means_um")},
            counts=np.array([counts[each["case"], point] for point in each["points"]], dtype=np.int64),
            rotation_rad=placed[each["case"]]["rotation_rad"],
            translation_um=placed[each["case"]]["translation_um"],
        )
        for each in document["cases"]
    )
    for case in cases:
        if (missing := np.setdiff1d(case.points, grids[case.plate].points)).size:
            raise InputError(phrase("comparators.no-point", plate=case.plate, point=int(missing[0])))
    operators = {}
    for each in document["pointing"]["operators"]:
        if (own := each["degrees_of_freedom"]) > 0:
            x, y = each["sd_um"]
            operators[int(each["operator"])] = (x**2, y**2, own)
    return RecordedCalibration(
        name=name,
        day=day_of(str(document["date"])),
        correction=correction,
        random_um=joint["sigma_random_um"],
        freedom=joint["degrees_of_freedom"],
        pointing_um=total["sd_um"] if freedom > 0 else (0.0, 0.0),
        pointing_covariance_um2=total["covariance_um2"] or 0.0,
        pointing_freedom=freedom,
        operators=operators,
        cases=cases,
        grids=grids,
    )


def _grid(plate: Any, own: Any) -> Grid:
    """Return a plate as given: corrected coordinates minus corrections."""
    given = np.array(plate["corrected_plate_um"]) - np.array(plate["corrections_plate_um"])
    sigma = plate["sigma_um"]["a_priori"]
    return Grid(
        number=int(plate["plate"]),
        points=np.array(plate["points"], dtype=np.int64),
        xy_um=given,
        sigma_um=float(own["sigma_um"] if sigma is None else sigma),
        adopted=str(plate["adopted"]),
        temperature_c=plate["temperature_c"],
        expansion_per_k=plate["expansion_per_k"],
    )


@dataclass(frozen=True, eq=False)
class Together:
    parameters: list[Floats]  # Correction parameters (21,) of each calibration
    covariance: Floats  # (k, 21, k, 21) covariance of all parameters; zero for fixed ones
    grids: dict[int, Grid]  # Plates as given to the first calibration with each
    # For each plate (l, 2) adjusted minus given coordinates, and their covariance (2 l, 2 l), ordered x, y
    # per point
    corrections_um: dict[int, Floats]
    covariance_um2: dict[int, Floats]
    # For each calibration and case (n, 2) residuals over their standard deviations, a priori unit weight
    standardized: list[list[Floats]]
    test: GlobalTest  # Test of all residuals and corrections against their standard deviations


@dataclass(frozen=True, eq=False)
class _Equations:
    """Linear equations of a calibration: v = A a + G dg + v0, with the weights of v.

    The unknowns a are all parameters, then the cases. `inverse` is the inverse of A' W A with zeros for fixed
    parameters, and `mixed` is A' W G.
    """

    own: Floats
    grid: Floats
    rest: Floats
    weight: Floats
    inverse: Floats
    mixed: Floats

    @property
    def right(self) -> Floats:
        return -self.own.T @ (self.weight * self.rest)


def adjust_together(records: Sequence[RecordedCalibration]) -> Together:
    grids = _grids(records)
    starts = dict(zip(grids, np.cumsum([0, *(len(grid.points) for grid in grids.values())]), strict=False))
    size = 2 * sum(len(grid.points) for grid in grids.values())
    readings = sum(2 * len(case.points) for record in records for case in record.cases)
    require(8 * size * (4 * size + 2 * readings), f"the covariance of {size // 2} grid points")
    sigma = np.repeat(
        [grid.sigma_um or 0.0 for grid in grids.values()], [2 * len(g.points) for g in grids.values()]
    )
    free = np.flatnonzero(sigma > 0)
    reduced = [_equations(record, grids, starts, size) for record in records]
    normal, right = np.zeros((size, size)), np.zeros(size)
    normal[free, free] = 1 / sigma[free] ** 2
    for each in reduced:
        normal += each.grid.T @ (each.weight[:, np.newaxis] * each.grid)
        normal -= each.mixed.T @ each.inverse @ each.mixed
        right -= each.grid.T @ (each.weight * each.rest) + each.mixed.T @ (each.inverse @ each.right)
    cofactors, shift = np.zeros((size, size)), np.zeros(size)
    cofactors[np.ix_(free, free)] = _inverse(normal[np.ix_(free, free)], "the grid")
    shift[free] = cofactors[np.ix_(free, free)] @ right[free]
    back = [each.inverse @ each.mixed for each in reduced]
    values = [each.inverse @ each.right - own @ shift for each, own in zip(reduced, back, strict=True)]
    squares, freedom, standardized = float((shift[free] ** 2 / sigma[free] ** 2).sum()), 0, []
    for record, each, own_back, steps in zip(records, reduced, back, values, strict=True):
        v, w = _residuals(each, own_back, steps, cofactors, shift)
        squares += float((each.weight * v**2).sum())
        # Every given coordinate is an observation and an unknown.
        freedom += v.size - int(np.count_nonzero(each.inverse.diagonal()))
        standardized.append(np.split(w, np.cumsum([len(case.points) for case in record.cases])[:-1]))
    test = global_test(squares, freedom)
    if test is None:
        raise AdjustmentError(phrase("comparators.no-redundancy"))
    scale = test.variance
    places = {
        plate: slice(2 * starts[plate], 2 * (starts[plate] + len(grid.points)))
        for plate, grid in grids.items()
    }
    return Together(
        parameters=[
            parameters_of(record.correction) + steps[:PARAMETERS]
            for record, steps in zip(records, values, strict=True)
        ],
        covariance=scale * _covariance(reduced, back, cofactors),
        grids=grids,
        corrections_um={plate: shift[place].reshape(-1, 2) for plate, place in places.items()},
        covariance_um2={plate: scale * cofactors[place, place] for plate, place in places.items()},
        standardized=standardized,
        test=test,
    )


def _grids(records: Sequence[RecordedCalibration]) -> dict[int, Grid]:
    """Return all plates with all measured points, from the first calibrations."""
    plates: dict[int, Grid] = {}
    for record in records:
        for plate, grid in record.grids.items():
            own = plates.setdefault(plate, grid)
            there = np.isin(grid.points, own.points)
            given = own.xy_um[own.rows_of(grid.points[there])] * _growth(own, grid)
            if there.any() and np.abs(given - grid.xy_um[there]).max() > SAME_UM:
                raise InputError(phrase("comparators.other-grid", name=record.name, plate=plate))
            points = np.concatenate([own.points, grid.points[~there]])
            more = grid.xy_um[~there] / _growth(own, grid)
            plates[plate] = replace(own, points=points, xy_um=np.vstack([own.xy_um, more]))
    return plates


SAME_UM = 1e-3  # rounding of given coordinates of a plate


def _growth(own: Grid, other: Grid) -> float:
    """Return the growth factor of plate coordinates relative to the first calibration."""
    if own.temperature_c is None or other.temperature_c is None or own.expansion_per_k is None:
        return 1.0
    return 1.0 + own.expansion_per_k * (other.temperature_c - own.temperature_c)


def _equations(
    record: RecordedCalibration, grids: Mapping[int, Grid], starts: Mapping[int, int], size: int
) -> _Equations:
    correction, counts = record.correction, [len(case.points) for case in record.cases]
    own = np.zeros((sum(counts), 2, PARAMETERS + 3 * len(counts)))
    grid = np.zeros((sum(counts), 2, size))
    rest, variance = np.empty((sum(counts), 2)), np.empty((sum(counts), 2))
    for k, (case, end) in enumerate(zip(record.cases, np.cumsum(counts).tolist(), strict=True)):
        readings, plate = np.arange(end - len(case.points), end), grids[case.plate]
        points = plate.rows_of(case.points)
        growth = _growth(plate, record.grids[case.plate])
        given = exchanged(plate.xy_um[points] * growth, case.left_handed)
        by_parameters, by_reading = partials_of(correction, case.means_um)
        corrected = correction.apply(case.means_um)
        turn = rotation_matrix(case.rotation_rad)
        # The case absorbs a shift of the corrected readings: both refer to their centre.
        away = corrected - corrected.mean(axis=0)
        turned = np.stack([away @ turn[1], -away @ turn[0]], axis=1)[..., np.newaxis]
        back = -np.asarray(np.linalg.inv(turn @ by_reading))
        own[readings, :, :PARAMETERS] = back @ turn @ by_parameters
        columns = PARAMETERS + 3 * k
        own[readings, :, columns : columns + 3] = np.concatenate([back @ turned, back], axis=2)
        places = 2 * (starts[case.plate] + points)[:, np.newaxis, np.newaxis] + np.arange(2)
        to_grid = -exchanged(back, case.left_handed)
        grid[readings[:, np.newaxis, np.newaxis], np.arange(2)[:, np.newaxis], places] = to_grid
        misfit = corrected @ turn.T + case.translation_um - given
        rest[readings] = (back @ misfit[..., np.newaxis])[..., 0]
        pointing = np.array(record.pointing_um) ** 2 / case.counts[:, np.newaxis]
        variance[readings] = record.random_um**2 + pointing
    weight, rows = 1 / variance.ravel(), 2 * len(rest)
    of_unknowns, of_grid = own.reshape(rows, -1), grid.reshape(rows, -1)
    weighted = (of_unknowns * weight[:, np.newaxis]).T
    fixed = np.flatnonzero(correction.covariance.diagonal() <= 0)
    free = np.delete(np.arange(of_unknowns.shape[1]), fixed)
    inverse = np.zeros((of_unknowns.shape[1],) * 2)
    inverse[np.ix_(free, free)] = _inverse((weighted @ of_unknowns)[np.ix_(free, free)], record.name)
    return _Equations(of_unknowns, of_grid, rest.ravel(), weight, inverse, weighted @ of_grid)


def _inverse(normal: Floats, what: str) -> Floats:
    scale = np.sqrt(np.diag(normal))
    try:
        root = np.linalg.cholesky(normal / np.outer(scale, scale))
    except np.linalg.LinAlgError:
        raise AdjustmentError(phrase("comparators.undetermined", what=what)) from None
    inverse = np.linalg.inv(root)
    return np.asarray((inverse.T @ inverse) / np.outer(scale, scale))


def _residuals(
    each: _Equations, back: Floats, steps: Floats, cofactors: Floats, shift: Floats
) -> tuple[Floats, Floats]:
    """Return the residuals (2 n,) of a calibration, and (n, 2) over their standard deviations."""
    v = each.own @ steps + each.grid @ shift + each.rest
    with_grid = back @ cofactors
    known = ((each.own @ (each.inverse + with_grid @ back.T)) * each.own).sum(axis=1)
    known += ((each.grid @ cofactors - 2 * each.own @ with_grid) * each.grid).sum(axis=1)
    left = 1 / each.weight - known
    checked = left * each.weight > 1e-6
    w = np.divide(v, np.sqrt(np.abs(left)), out=np.full(v.shape, np.nan), where=checked)
    return v, w.reshape(-1, 2)


def _covariance(reduced: Sequence[_Equations], back: Sequence[Floats], cofactors: Floats) -> Floats:
    by_grid = np.concatenate([own[:PARAMETERS] for own in back])
    covariance: Floats = by_grid @ cofactors @ by_grid.T
    for k, each in enumerate(reduced):
        own = slice(k * PARAMETERS, (k + 1) * PARAMETERS)
        covariance[own, own] += each.inverse[:PARAMETERS, :PARAMETERS]
    return covariance.reshape(2 * (len(reduced), PARAMETERS))
