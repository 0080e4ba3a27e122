"""Joint adjustment of many calibrations with separate comparators and cases, and common plates.

Linear about the joint adjustments of the calibrations. A reading x of the grid point g (plate, in the
handedness of the comparator) has the residual

    v = -(M J)^-1 (M Q dp + M' C dtheta + dT - dg + w),   w = M C(x) + T - g.

C is the corrected reading with the partials J by the reading and Q by the parameters p. M is the rotation and
T the translation of the case. Parameters and cases of a calibration are eliminated. The result are normal
equations of grid corrections, to which given coordinates add 1 / sigma^2. The covariance of the parameters
contains the remaining errors common to several calibrations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.case import exchanged
from photogram.comparator.correction import PARAMETERS, parameters_of, partials_of
from photogram.comparator.fits import rotation_matrix
from photogram.comparator.grid import Grid
from photogram.comparator.years.record import RecordedCalibration
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.memory import require
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import phrase


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
