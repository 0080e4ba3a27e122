"""Corners and boards drawn anew: errors of cameras, maps, points and parts are as large as they say."""

import given_targets
import numpy as np
import pytest

from photogram.targets import cross_validate, simulate_corners, triangulate
from photogram.targets.cross_validation import changes_between
from photogram.targets.housing import common_partials, datum_rows, housing_of, housing_rows
from photogram.targets.vision import imaged

DRAWS = 60
PIXELS = np.array([[100.0, 100.0], [640.0, 480.0], [1150.0, 800.0]])
POINTS = np.array([[0.1, 0.0, 0.7], [-0.2, 0.1, 2.0]])


@pytest.fixture(scope="module")
def draws():
    """Return adjusted calibrations of drawn corners."""
    true = given_targets.rig_small()
    return [simulate_corners(true, seed).adjust() for seed in range(DRAWS)]


def _within(ratios, freedom):
    """Whether the mean of chi-square over its degrees of freedom is 1 within three standard deviations."""
    return abs(np.mean(ratios) - 1) < 3 * np.sqrt(2 / (freedom * len(ratios)))


def _errors(calibrated):
    """Return errors of cameras and sensor, their cofactors, and the housing of an adjusted calibration."""
    housing = housing_of(calibrated)[0]
    given = calibrated.calibration
    change = np.zeros(22)
    for number, (found, true) in enumerate(zip(housing.cameras, given.cameras, strict=True)):
        change[housing.parameters(number)] = found.values - true.values
    turn = housing.sensors[1] @ np.linalg.inv(given.sensors[1])
    change[16:19] = housing.sensors[1][:3, 3] - given.sensors[1][:3, 3]
    change[19:] = [turn[2, 1], turn[0, 2], turn[1, 0]]
    return change, housing


def test_cameras_and_sensor(draws):
    ratios = []
    for each in draws:
        change, housing = _errors(each)
        ratios.append(change @ np.linalg.solve(housing.cofactors[:22, :22], change) / 22)
    assert _within(ratios, 22)


@pytest.mark.parametrize("distance", [np.inf, 1.0])
def test_maps(draws, distance):
    ratios = []
    for each in draws:
        change, housing = _errors(each)
        rows = datum_rows(housing, 0, "corners")
        partials = common_partials(housing, 0, PIXELS, distance, rows)[:, :, :22]
        moved = partials @ change
        cofactors = partials @ housing.cofactors[:22, :22] @ partials.transpose(0, 2, 1)
        ratios += [(d @ np.linalg.solve(q, d)) / 2 for d, q in zip(moved, cofactors, strict=True)]
    # Pixels of one calibration are correlated: each counts for a third.
    assert abs(np.mean(ratios) - 1) < 3 * np.sqrt(2 / (2 * DRAWS))


def test_triangulated_points(draws):
    """Points by exact images have the errors of the calibration alone, in the axes of camera 0."""
    by_axes, by_housing = [], []
    true = draws[0].calibration
    sensor = true.sensors[1]
    seen = [imaged(true.cameras[0], POINTS).xy]
    seen.append(imaged(true.cameras[1], POINTS @ sensor[:3, :3].T + sensor[:3, 3]).xy)
    for each in draws:
        found = triangulate(each, (0, 1), np.stack(seen, axis=1), 0.3)
        error = (found.points - POINTS).ravel()
        covariance = found.by_calibration / each.covariance_scale
        by_axes.append(error @ np.linalg.solve(covariance, error) / 6)
        change, housing = _errors(each)
        motion = housing_rows(housing)[:, :22] @ change
        fixed = triangulate(each, (0, 1), np.stack(seen, axis=1), 0.3, "corners")
        left = error - (motion[:3] + np.cross(motion[3:], POINTS)).ravel()
        covariance = fixed.by_calibration / each.covariance_scale
        by_housing.append(left @ np.linalg.solve(covariance, left) / 6)
    assert _within(by_axes, 6)
    assert _within(by_housing, 6)


def test_parts_of_the_views(draws):
    ratios = []
    for each in draws[:12]:
        change, cofactors = changes_between(*cross_validate(each).housings[0])
        ratios.append(change[:22] @ np.linalg.solve(cofactors[:22, :22], change[:22]) / 22)
    assert _within(ratios, 22)
