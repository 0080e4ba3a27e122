"""Backward cameras whose measured coordinates have the standard deviations: D S D' in the corrected image."""

import numpy as np
import pytest

from example_scripts import load
from message_codes import raises
from photogram import Camera, InputError, _photocore, adjust
from photogram.network import rotation_matrix

LENS = {"c": -24.3, "xp": 0.1, "yp": -0.05, "K1": -3e-4, "K2": 2e-7, "P1": 1e-5, "P2": -2e-5, "b1": 1e-4}
FREE = {"c": np.inf, "xp": np.inf, "yp": np.inf, "K1": np.inf, "K2": np.inf}
SD = 0.005


@pytest.fixture(scope="module")
def exact():
    """Return a convergent block whose images are those of the lens, without errors."""
    block = load("self_calibration").measured()
    camera = Camera("brown", LENS, name="strong")
    found = adjust(block.replace(cameras=[camera]))
    to_photo = rotation_matrix(found.photo_attitudes)
    offsets = found.point_positions[block.image_points] - found.photo_positions[block.image_photos]
    u = np.einsum("mij,mj->mi", to_photo[block.image_photos], offsets)
    return block.replace(
        image_xy=camera.project(u),
        image_sd=SD,
        cameras=[camera.replace(sd=FREE)],
        photo_positions=found.photo_positions,
        photo_attitudes=found.photo_attitudes,
        point_positions=np.where(np.isfinite(block.point_sd), found.point_positions, np.nan),
    )


def in_weights(block, weights):
    return block.replace(cameras=[camera.replace(weights=weights) for camera in block.cameras])


def test_residuals_and_cofactors_are_those_of_weights_by_the_gradient_of_the_lens(exact):
    """Without errors D S D' are weights like any others: cofactors are those of the corrected image."""
    result = adjust(in_weights(exact, "measured"), unit_variance="unity")
    camera = exact.cameras[0]
    step = 1e-4
    gradient = np.stack(
        [
            (corrected(camera, exact.image_xy + shift) - corrected(camera, exact.image_xy - shift))
            / (2 * step)
            for shift in step * np.eye(2)
        ],
        axis=-1,
    )
    # One standard deviation for each coordinate: D D' is nearly diagonal where b2 and P are small.
    weight = np.einsum("mij,mkj->mik", gradient, gradient)
    sd = SD * np.sqrt(np.einsum("mii->mi", weight))
    other = adjust(in_weights(exact.replace(image_sd=sd), "corrected"), unit_variance="unity")
    plain = adjust(in_weights(exact, "corrected"), unit_variance="unity")
    off = np.abs(weight[:, 0, 1]) / np.sqrt(weight[:, 0, 0] * weight[:, 1, 1])
    assert np.ptp(np.linalg.det(gradient)) > 0.1
    assert off.max() < 0.2
    free = result.cameras[0].sd > 0
    near, far = (
        np.abs(result.cameras[0].sd[free] / found.cameras[0].sd[free] - 1).max() for found in (other, plain)
    )
    assert near < 0.25 * far
    np.testing.assert_allclose(result.residuals, 0.0, atol=1e-7)
    assert not any("redundancy numbers sum" in str(message) for message in result.messages)


def corrected(camera, xy):
    return _photocore.camera_correct(camera.model, camera.values, xy)


def test_errors_of_measured_coordinates_have_a_variance_of_one(exact):
    """Twenty samples of 12 photos: the mean variance of unit weight, and the coverage of the camera."""
    rng, variances, ratios = np.random.default_rng(8), [], []
    plain = []
    truth = exact.cameras[0].values
    for _ in range(20):
        block = exact.replace(image_xy=exact.image_xy + rng.normal(0.0, SD, exact.image_xy.shape))
        result = adjust(in_weights(block, "measured"))
        variances.append(result.variance_of_unit_weight)
        plain.append(adjust(in_weights(block, "corrected")).variance_of_unit_weight)
        found = result.cameras[0]
        sd = found.sd / np.sqrt(result.covariance_scale)
        ratios.append(((found.values - truth)[sd > 0] / sd[sd > 0]) ** 2)
    spread = np.sqrt(2 / result.degrees_of_freedom / len(variances))
    assert abs(np.mean(variances) - 1.0) < 4 * spread
    assert np.mean(plain) < 1.0 - 4 * spread
    # Five parameters, twenty samples: each mean of squares has a standard deviation of 0.32.
    assert (np.abs(np.mean(ratios, axis=0) - 1.0) < 1.3).all()


def test_residuals_are_the_measured_ones_less_the_image(exact):
    shifted = exact.replace(
        image_xy=exact.image_xy + np.random.default_rng(1).normal(0, SD, exact.image_xy.shape)
    )
    measured, other = (adjust(in_weights(shifted, weights)) for weights in ("measured", "corrected"))
    # To first order the residual in the corrected image is D times that in the measured one.
    camera = measured.cameras[0].camera
    ahead = corrected(camera, exact.image_xy) - corrected(camera, exact.image_xy - measured.residuals)
    assert np.abs(ahead - other.residuals).max() < 0.3 * SD
    assert np.corrcoef(ahead.ravel(), other.residuals.ravel())[0, 1] > 0.99


def test_forward_cameras_have_no_such_weights():
    with raises(InputError, "error.not-applicable"):
        Camera("opencv", {"fx": 1000.0, "fy": 1000.0, "cx": 0.0, "cy": 0.0}, weights="measured")
    with pytest.raises(InputError, match="weights"):
        Camera("brown", {"c": -20.0}, weights="both")
    with raises(InputError, "model: must be one of|error.choice"):
        Camera("brown_measured", {"c": -20.0})
