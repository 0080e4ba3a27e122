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

from photogram.arguments.types import Floats, Indices
from photogram.comparator.case import exchanged
from photogram.comparator.correction import PARAMETERS, parameters_of, partials_of
from photogram.comparator.fits import rotation_matrix
from photogram.comparator.grid import Grid
from photogram.comparator.years.record import RecordedCalibration, RecordedCase
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.memory import require
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Together:
    """Result of the adjustment of all calibrations."""

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
class _Case:
    """Linear equations of a case: v = A a + G dg + v0, unknowns a, weights of v."""

    own: Floats
    grid: Floats
    rest: Floats
    weight: Floats
    rows: Indices


@dataclass(frozen=True, eq=False)
class _Reduced:
    """Calibration with its own unknowns eliminated."""

    cases: list[_Case]
    active: Indices
    inverse: Floats
    mixed: Floats
    right: Floats
    unknowns: int


def adjust_together(records: Sequence[RecordedCalibration]) -> Together:
    """Adjust all calibrations together."""
    grids = _grids(records)
    starts = dict(zip(grids, np.cumsum([0, *(len(grid.points) for grid in grids.values())]), strict=False))
    size = 2 * sum(len(grid.points) for grid in grids.values())
    require(4 * 8 * size**2, f"the covariance of {size // 2} grid points")
    normal, right = np.zeros((size, size)), np.zeros(size)
    sigma = np.repeat(
        [grid.sigma_um or 0.0 for grid in grids.values()], [2 * len(g.points) for g in grids.values()]
    )
    free = np.flatnonzero(sigma > 0)
    reduced = [_reduce(record, grids, starts, normal, right) for record in records]
    normal[free, free] += 1 / sigma[free] ** 2
    cofactors, shift = np.zeros((size, size)), np.zeros(size)
    cofactors[np.ix_(free, free)] = _inverse(normal[np.ix_(free, free)], "the grid")
    shift[free] = cofactors[np.ix_(free, free)] @ right[free]
    back = [each.inverse @ each.mixed for each in reduced]
    values = [each.inverse @ each.right - own @ shift for each, own in zip(reduced, back, strict=True)]
    standardized, squares, count = _residuals(reduced, back, values, cofactors, shift)
    squares += float((shift[free] ** 2 / sigma[free] ** 2).sum())
    # Every given coordinate is an observation and an unknown.
    test = global_test(squares, count - sum(each.unknowns for each in reduced))
    if test is None:
        raise AdjustmentError(phrase("comparators.no-redundancy"))
    scale = test.variance
    places = {
        plate: slice(2 * starts[plate], 2 * (starts[plate] + len(grid.points)))
        for plate, grid in grids.items()
    }
    return Together(
        parameters=[
            parameters_of(record.correction) + _spread(each.active, steps[: len(each.active)])
            for record, each, steps in zip(records, reduced, values, strict=True)
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


def _reduce(
    record: RecordedCalibration,
    grids: Mapping[int, Grid],
    starts: Mapping[int, int],
    normal: Floats,
    right: Floats,
) -> _Reduced:
    """Add a calibration to the normal equations of the grid, for back substitution."""
    active = np.flatnonzero(np.diag(record.correction.covariance) > 0)
    unknowns = len(active) + 3 * len(record.cases)
    inner, own_right = np.zeros((unknowns, unknowns)), np.zeros(unknowns)
    mixed = np.zeros((unknowns, len(right)))
    cases = []
    for k, case in enumerate(record.cases):
        columns = np.concatenate([np.arange(len(active)), len(active) + 3 * k + np.arange(3)])
        made = _equations(record, case, grids[case.plate], starts[case.plate], active)
        cases.append(made)
        weighted = made.weight[..., np.newaxis] * made.own
        inner[np.ix_(columns, columns)] += np.einsum("nia,nib->ab", made.own, weighted)
        own_right[columns] -= np.einsum("nia,ni->a", weighted, made.rest)
        places = 2 * made.rows[:, np.newaxis] + np.arange(2)
        across = np.einsum("nia,nij->anj", weighted, made.grid)
        np.add.at(mixed, np.ix_(columns, places.ravel()), across.reshape(len(columns), -1))
        within = np.einsum("nij,ni,nik->njk", made.grid, made.weight, made.grid)
        np.add.at(normal, (places[:, :, np.newaxis], places[:, np.newaxis, :]), within)
        np.subtract.at(right, places, np.einsum("nij,ni->nj", made.grid, made.weight * made.rest))
    inverse = _inverse(inner, record.name)
    normal -= mixed.T @ inverse @ mixed
    right -= mixed.T @ (inverse @ own_right)
    return _Reduced(cases, active, inverse, mixed, own_right, unknowns)


def _equations(
    record: RecordedCalibration, case: RecordedCase, grid: Grid, start: int, active: Indices
) -> _Case:
    rows = grid.rows_of(case.points)
    given = exchanged(grid.xy_um[rows] * _growth(grid, record.grids[case.plate]), case.left_handed)
    correction = record.correction
    by_parameters, by_reading = partials_of(correction, case.means_um)
    corrected = correction.apply(case.means_um)
    turn = rotation_matrix(case.rotation_rad)
    # The case absorbs a shift of the corrected readings: both refer to their centre.
    away = corrected - corrected.mean(axis=0)
    turned = np.stack([away @ turn[1], -away @ turn[0]], axis=1)[..., np.newaxis]
    back = -np.asarray(np.linalg.inv(turn @ by_reading))
    ones = np.broadcast_to(np.eye(2), (len(rows), 2, 2))
    own = back @ np.concatenate([turn @ by_parameters[:, :, active], turned, ones], axis=2)
    rest = back @ (corrected @ turn.T + case.translation_um - given)[..., np.newaxis]
    variance = record.random_um**2 + np.array(record.pointing_um) ** 2 / case.counts[:, np.newaxis]
    to_grid = -back[:, :, ::-1] if case.left_handed else -back
    return _Case(np.asarray(own), to_grid, rest[..., 0], 1 / variance, start + rows)


def _inverse(normal: Floats, what: str) -> Floats:
    scale = np.sqrt(np.diag(normal))
    try:
        root = np.linalg.cholesky(normal / np.outer(scale, scale))
    except np.linalg.LinAlgError:
        raise AdjustmentError(phrase("comparators.undetermined", what=what)) from None
    inverse = np.linalg.inv(root)
    return np.asarray((inverse.T @ inverse) / np.outer(scale, scale))


def _residuals(
    reduced: Sequence[_Reduced],
    back: Sequence[Floats],
    values: Sequence[Floats],
    cofactors: Floats,
    shift: Floats,
) -> tuple[list[list[Floats]], float, int]:
    """Return standardized residuals, the weighted sum of squares, and the count."""
    standardized, squares, count = [], 0.0, 0
    for each, own_back, own_values in zip(reduced, back, values, strict=True):
        with_grid = own_back @ cofactors
        own_cofactors = each.inverse + with_grid @ own_back.T
        of_cases = []
        for k, case in enumerate(each.cases):
            columns = np.concatenate([np.arange(len(each.active)), len(each.active) + 3 * k + np.arange(3)])
            places = 2 * case.rows[:, np.newaxis] + np.arange(2)
            v = case.own @ own_values[columns] + case.rest
            v += np.einsum("nij,nj->ni", case.grid, shift[places])
            squares += float((case.weight * v**2).sum())
            count += v.size
            known = np.einsum("nia,ab,nib->ni", case.own, own_cofactors[np.ix_(columns, columns)], case.own)
            crossed = with_grid[columns][:, places]
            known -= 2 * np.einsum("nia,anj,nij->ni", case.own, crossed, case.grid)
            blocks = cofactors[places[:, :, np.newaxis], places[:, np.newaxis, :]]
            known += np.einsum("nij,njk,nik->ni", case.grid, blocks, case.grid)
            left = 1 / case.weight - known
            checked = left * case.weight > 1e-6
            of_cases.append(np.divide(v, np.sqrt(np.abs(left)), out=np.full(v.shape, np.nan), where=checked))
        standardized.append(of_cases)
    return standardized, squares, count


def _spread(active: Indices, values: Floats) -> Floats:
    full = np.zeros(PARAMETERS)
    full[active] = values
    return full


def _covariance(reduced: Sequence[_Reduced], back: Sequence[Floats], cofactors: Floats) -> Floats:
    count = len(reduced)
    blocks = np.zeros((count, count, PARAMETERS, PARAMETERS))
    for i, first in enumerate(reduced):
        own = first.active
        blocks[i, i][np.ix_(own, own)] = first.inverse[: len(own), : len(own)]
        common = back[i][: len(own)] @ cofactors
        for j, second in enumerate(reduced):
            other = second.active
            blocks[i, j][np.ix_(own, other)] += common @ back[j][: len(other)].T
    return blocks.transpose(0, 2, 1, 3)
