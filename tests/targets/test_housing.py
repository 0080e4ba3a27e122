"""Adjusted calibrations as arrays of a housing, against an independent program."""

import numpy as np
import pytest
from golden_calibrations import adjusted_rig, rig_small

from photogram.targets import cross_validate
from photogram.targets.housing import housing_of
from photogram.targets.vision import sensor_steps


def test_a_rig_has_the_arrays_of_the_golden_one():
    found, camera = housing_of(adjusted_rig(), 1)
    expected = rig_small()
    assert camera == 1
    sd = np.sqrt(np.diag(expected.cofactors))
    assert np.abs((found.cofactors - expected.cofactors) / np.outer(sd, sd)).max() < 1e-6
    assert found.weights == pytest.approx(expected.weights)
    assert found.points == pytest.approx(expected.points, abs=1e-10)
    assert found.poses == pytest.approx(expected.poses, abs=1e-9)
    assert found.seen.sd.sum() == pytest.approx(expected.seen.sd.sum())


def test_it_is_made_once():
    assert housing_of(adjusted_rig(), 0)[0] is housing_of(adjusted_rig(), 1)[0]


def test_a_weighted_sensor_is_known_before_the_corners():
    """Q = (N + P)^-1 with the weight P of the sensor, and Q N Q what corners alone make of it."""
    free = adjusted_rig()
    sd = np.array([2e-5, 3e-5, 4e-5, 5e-5, 6e-5, 7e-5])
    given = free.restarted_calibration()
    weighted = given.replace(sd_sensors=np.stack([np.full(6, np.inf), sd])).adjust()
    steps = sensor_steps(free.sensors[1])
    before, after = housing_of(free)[0], housing_of(weighted)[0]
    common, own = slice(before.common), after.sensor(1)
    prior = np.zeros((before.common, before.common))
    prior[own, own] = np.linalg.inv(steps @ np.diag(sd**2) @ steps.T)
    assert after.weights[own, own] == pytest.approx(prior[own, own], rel=1e-6, abs=1e-3)
    normal = np.linalg.inv(before.cofactors[common, common])
    expected = np.linalg.inv(normal + prior)
    scale = np.sqrt(np.diag(expected))
    assert np.abs((after.cofactors[common, common] - expected) / np.outer(scale, scale)).max() < 1e-4
    # What was known of the points is taken out as well.
    noise = expected - expected @ (prior + before.weights) @ expected
    found = after.noise_only().cofactors[common, common]
    assert np.abs((found - noise) / np.outer(scale, scale)).max() < 1e-4
    assert np.all(np.diag(after.cofactors)[own] < np.diag(before.cofactors)[own])
    assert cross_validate(weighted).explained
    assert weighted.restarted_calibration().sensors[1] == pytest.approx(given.sensors[1], abs=0)
