"""Large plates: memory grows with the points, and what was quadratic gives what the simple way gives."""

import tracemalloc
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from plates import QUICK, STRAIGHT, noisy

from photogram import OutOfMemoryError
from photogram.comparator import Grid, calibrate, listing, simulate_calibration
from photogram.comparator.averages import GridSigma
from photogram.comparator.calibration import needed_memory
from photogram.comparator.case import locations
from photogram.comparator.readings import group_as_listed, read_points, rows_by_point


def plate(columns):
    return Grid.square(columns, spacing_um=200_000.0 / (columns - 1), sigma_um=0.3)


def large(columns, seed=1, **options):
    """Return a session of four cases, two pointings on each point."""
    grid = plate(columns)
    sequence = np.concatenate([np.repeat(grid.points, 2), grid.points[:1].repeat(3)])
    return noisy(seed, grid=grid, sequence=sequence, **options)


def peak(session):
    """Return the most memory that all stages, the listing and the document hold at once, in bytes."""
    tracemalloc.start()
    try:
        calibration = calibrate(session, QUICK)
        listing(calibration)
        calibration.to_json()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@cache
def peak_of(columns):
    return peak(large(columns))


def test_memory_grows_with_the_points():
    """Matrices of the readings squared held 680 MB for 24 x 24 points, and grew 16 times to 48 x 48."""
    peak(large(6))
    small, double = peak_of(24), peak_of(48)
    assert small < 40e6
    assert double < 5 * small


def test_the_estimate_of_memory_holds():
    for columns in (6, 24, 48):
        session = large(columns)
        assert peak_of(columns) < needed_memory(sum(len(case.points) for case in session.cases))


def test_what_memory_does_not_hold_is_refused(monkeypatch):
    session = large(6)
    pointings = sum(len(case.points) for case in session.cases)
    monkeypatch.setattr("photogram.memory.available_memory", lambda: needed_memory(pointings) - 1)
    with pytest.raises(OutOfMemoryError, match=f"{pointings} pointings") as refused:
        calibrate(session, QUICK)
    assert refused.value.code == "memory.required"
    monkeypatch.setattr("photogram.memory.available_memory", lambda: needed_memory(pointings))
    calibrate(session, QUICK)


def dense_grid_sigma(grid_rows, cases, stage):
    """Return the standard deviations of a :class:`GridSigma` with matrices of all readings, for one plate."""
    places = [fit.residuals.xy_um for fit in stage.cases]
    rows = 2 * sum(len(own) for own in places)
    everywhere = np.vstack(places)
    u, v = ((everywhere - everywhere.mean(axis=0)) / np.abs(everywhere - everywhere.mean(axis=0)).max()).T
    functions = [u**4, v**4, u**3, v**3, u**2, v**2, u, v, u * 0 + 1]
    both = np.zeros((rows, 18))
    for k, function in enumerate(functions):
        both[0::2, k], both[1::2, 9 + k] = function, function
    rigid, spread = np.zeros((rows, 3 * len(places))), np.zeros((rows, 2 * (grid_rows[0].max() + 1)))
    start = 0
    for k, (own, case) in enumerate(zip(places, cases, strict=True)):
        x, y = (own - own.mean(axis=0)).T / 1e5
        here = slice(start, start + 2 * len(own))
        rigid[here, 3 * k : 3 * k + 3] = (
            np.array([[1 + 0 * x, 0 * x, -y], [0 * x, 1 + 0 * x, x]]).transpose(2, 0, 1).reshape(-1, 3)
        )
        c, s = np.cos(stage.cases[k].rotation_rad), np.sin(stage.cases[k].rotation_rad)
        turn = np.array([[c, -s], [s, c]])
        turn = turn[:, ::-1] if case.orientation.left_handed else turn
        for row, column in enumerate(grid_rows[k].tolist()):
            at = start + 2 * row
            spread[at : at + 2, 2 * column : 2 * column + 2] = turn
        start = here.stop
    linear = np.hstack([rigid, both[:, [6, 16, 7]]])
    reduction = np.eye(rows)
    for step in (linear, both, rigid):
        basis = np.linalg.svd(step, full_matrices=False)[0]
        reduction = reduction - basis @ (basis.T @ reduction)
    averaging = spread.T / (spread**2).sum(axis=0)[:, np.newaxis]
    residuals = np.concatenate([fit.residuals.comparator_um.ravel() for fit in stage.cases])
    forms = [
        [((averaging @ reduction @ spread) ** 2).sum(), ((averaging @ reduction) ** 2).sum()],
        [((reduction @ spread) ** 2).sum(), (reduction**2).sum()],
    ]
    return np.sqrt(np.linalg.solve(forms, [((averaging @ residuals) ** 2).sum(), residuals @ residuals]))


@pytest.mark.parametrize("left_handed", [False, True])
def test_the_sigma_of_the_grid_is_that_of_dense_matrices(left_handed):
    session = noisy(4, left_handed=left_handed)
    case = session.cases[1]
    rows = np.flatnonzero(~np.isin(case.points, [3, 4, 19]))
    fields = {"points": case.points[rows], "legs": case.legs[rows], "xy_um": case.xy_um[rows]}
    incomplete = replace(case, places=case.places[: len(rows)], **fields)
    session = replace(session, cases=(session.cases[0], incomplete, *session.cases[2:]))
    calibration = calibrate(session, QUICK)
    placed = [case.placed for case in calibration.cases]
    grid_rows = [session.grids[1].rows_of(case.points) for case in placed]
    sigma = GridSigma(session.grids, placed, calibration.nonlinear)
    expected = dense_grid_sigma(grid_rows, placed, calibration.nonlinear)
    assert [sigma.by_plate[1], sigma.random] == pytest.approx(expected, rel=1e-9)


def swapped(points):
    """Bring equal points together as the listing does, comparing each with each."""
    order, values = list(range(len(points))), points.tolist()
    start = 0
    while start < len(order):
        end = start + 1
        for later in range(end, len(order)):
            if values[later] == values[start]:
                for row in (order, values):
                    row[end], row[later] = row[later], row[end]
                end += 1
        start = end
    return order


def test_grouping_is_that_of_comparing_each_with_each():
    random = np.random.default_rng(2)
    for _ in range(300):
        points = random.integers(1, random.integers(2, 12), size=random.integers(1, 50))
        assert group_as_listed(points).tolist() == swapped(points)
        groups = rows_by_point(points)
        assert [point for point, _ in groups] == list(dict.fromkeys(points.tolist()))
        assert all(rows.tolist() == np.flatnonzero(points == point).tolist() for point, rows in groups)
    assert rows_by_point(np.zeros(0, dtype=np.int64)) == []


def test_readings_are_summed_up_point_by_point():
    random = np.random.default_rng(3)
    points = random.integers(1, 9, size=60)
    xy = 1e5 + random.normal(size=(60, 2))
    for own in read_points(points, xy):
        readings = xy[points == own.point]
        deviations = readings - readings.mean(axis=0)
        assert own.count == len(readings)
        assert own.mean_um == pytest.approx(readings.mean(axis=0), abs=1e-9)
        assert own.squares_um2 == pytest.approx((deviations**2).sum(axis=0), abs=1e-8)
        assert own.products_um2 == pytest.approx(deviations.prod(axis=1).sum(), abs=1e-8)


def test_locations_of_a_large_plate_are_a_turned_pattern():
    grid = plate(60)
    numbers = grid.points.reshape(60, 60)
    turned = {1: numbers, 3: numbers[::-1, ::-1], 2: np.rot90(numbers), 4: np.rot90(numbers, -1)}
    for corner, expected in turned.items():
        found = locations(grid, corner).reshape(60, 60)
        assert (found == expected).all() or (found == np.rot90(expected, 2)).all()
        assert sorted(found.ravel().tolist()) == grid.points.tolist()
    scattered = replace(grid, xy_um=np.random.default_rng(1).uniform(-1e5, 1e5, grid.xy_um.shape))
    assert locations(scattered, 2) is None


def test_a_large_plate_is_calibrated_as_a_small_one():
    simulation = simulate_calibration(
        plate(40), STRAIGHT, pointing_um=0.9, random_um=0.6, grid_um=0.3, seed=5, left_handed=True
    )
    calibration = calibrate(simulation.session)
    assert calibration.usable
    assert calibration.sigma_grid_um(1) == pytest.approx(0.3, abs=0.02)
    assert calibration.joint.random_um == pytest.approx(0.6, abs=0.02)
    deviations = [
        calibration.linear.correction.scale_x - STRAIGHT.scale_x,
        calibration.linear.correction.scale_y - STRAIGHT.scale_y,
    ]
    assert np.abs(deviations).max() < 4 * np.sqrt(np.diag(calibration.linear.covariance)[:2]).max()
