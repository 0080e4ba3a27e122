"""A camera whose plates are read on a calibrated comparator: its correction is an observation of a block."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from message_codes import refusal
from photogram import Camera, adjust, comparator, simulate

DECK = Path(str(files("photogram") / "examples" / "comparator" / "comparator-3.txt"))
LENS = {"c": -150.0, "xp": 2.0, "yp": -1.0, "K1": 2e-8, "P1": 1e-7}


@pytest.fixture(scope="module")
def calibration():
    return comparator.calibrate(comparator.read([DECK])[0])


@pytest.mark.parametrize("method", ["report", "joint"])
def test_readings_are_corrected_then_seen_by_the_lens(calibration, method):
    correction = calibration.correction if method == "report" else calibration.joint.correction
    camera = correction.as_camera(Camera("brown", LENS))
    readings = np.random.default_rng(1).uniform(20_000, 230_000, (50, 2))
    frame = correction.polynomial.frame
    expected = (correction.apply(readings) - frame.centre_um) / 1000.0
    rays = camera.rays(readings / 1000.0)
    np.testing.assert_allclose(rays, Camera("brown", LENS).rays(expected), atol=1e-14)
    np.testing.assert_allclose(camera.project(rays), readings / 1000.0, atol=1e-10)
    # The covariance of corrected readings is that of the correction.
    plain = correction.as_camera(Camera("brown", {"c": -150.0}))
    names, covariance = plain.covariance
    base, partials = plain.rays(readings[:5] / 1000.0), []
    for name, sd in zip(names, np.sqrt(np.diag(covariance)), strict=True):
        ends = [
            plain.replace(
                parameters={**plain.parameters, name: plain.parameters[name] + sign * sd}, covariance=None
            ).rays(readings[:5] / 1000.0)
            for sign in (1, -1)
        ]
        plus, minus = (150.0 * end[:, :2] / -end[:, 2:] for end in ends)
        partials.append((plus - minus) / (2 * sd))
    jacobian = np.stack(partials, axis=-1)
    found = 1e6 * np.einsum("nik,kl,njl->nij", jacobian, covariance, jacobian)
    assert np.isfinite(base).all()
    np.testing.assert_allclose(found, correction.covariance_of(readings[:5]), rtol=1e-5, atol=1e-6)


def test_it_is_weighted_in_a_block(calibration):
    correction = calibration.joint.correction
    camera = correction.as_camera(Camera("brown", {"c": -150.0, "xp": 0.0, "yp": 0.0}, name="metric"))
    simulation = simulate(strips=2, photos_per_strip=4, seed=5, cameras=[camera], start_cameras=[camera])
    result = adjust(simulation.block)
    assert result.converged
    names, prior = camera.covariance
    rows = [camera.names.index(name) for name in names]
    ratio = result.cameras[0].sd[rows] ** 2 / result.covariance_scale / np.diag(prior)
    assert (ratio < 1 + 1e-9).all()
    assert result.cameras[0].redundancy[rows].sum() > 0
    assert correction.as_camera(Camera("brown", {"c": -150.0}), weighted=False).is_held


def test_what_the_comparator_has_itself_is_refused(calibration):
    correction = calibration.joint.correction
    for camera, message in (
        (Camera("perspective", {"c": -150.0}), "comparators.camera camera=perspective"),
        (Camera("brown", {"c": -150.0, "b1": 1e-4}), "comparators.camera camera=brown"),
        (Camera("brown", {"c": -150.0}, sd={"b2": np.inf}), "comparators.camera-free camera=brown"),
    ):
        with refusal(message):
            correction.as_camera(camera)


def test_a_prior_of_the_camera_stands_beside_that_of_the_comparator(calibration):
    own = np.array([[1e-4, 1e-9], [1e-9, 1e-12]])
    camera = calibration.joint.correction.as_camera(
        Camera("brown", {"c": -150.0, "K1": 1e-8}, covariance=(["c", "K1"], own), sd={"xp": np.inf})
    )
    names, matrix = camera.covariance
    assert list(names[-2:]) == ["c", "K1"]
    np.testing.assert_array_equal(matrix[-2:, -2:], own)
    assert not matrix[-2:, :-2].any()
    assert camera.deviations[camera.names.index("xp")] == np.inf
