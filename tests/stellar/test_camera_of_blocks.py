"""A camera calibrated by stars is one that blocks take, with its covariance."""

import numpy as np

from photogram import adjust, simulate
from photogram.stellar.cameras import BrownCamera

VALUES = np.array([8000.0, 8010.0, 6010.0, 5990.0, -0.02, 0.004, -3e-4, 1e-4, -2e-4])
SD = np.array([0.5, 0.5, 0.8, 0.8, 2e-4, 2e-4, 1e-5, 1e-5, 0.0])
"""p2 was held."""
_FACTOR = np.tril(np.random.default_rng(4).uniform(-0.5, 0.5, (9, 9)), -1) + np.eye(9)
_CORRELATED = _FACTOR @ _FACTOR.T / np.sqrt(np.outer(*[np.diag(_FACTOR @ _FACTOR.T)] * 2))
CALIBRATED = BrownCamera(VALUES, _CORRELATED * np.outer(SD, SD))


def test_images_are_those_of_its_formula():
    u, v = np.random.default_rng(5).uniform(-0.7, 0.7, (2, 20))
    fx, fy, cx, cy, k1, k2, k3, p1, p2 = VALUES
    square = u * u + v * v
    radial = 1 + square * (k1 + square * (k2 + square * k3))
    x = fx * (u * radial + 2 * p1 * u * v + p2 * (square + 2 * u * u)) + cx
    y = fy * (v * radial + p1 * (square + 2 * v * v) + 2 * p2 * u * v) + cy
    # The axes of a photo are x right, y up, z back.
    images = CALIBRATED.as_camera().project(np.column_stack([u, -v, -np.ones(20)]))
    np.testing.assert_allclose(images, np.column_stack([x, y]), atol=1e-9)


def test_it_is_an_observation_with_its_covariance():
    camera = CALIBRATED.as_camera("stars")
    names = [name for name in CALIBRATED.NAMES if name != "p2"]
    assert camera.parameters["k3"] == VALUES[6]
    assert {name: camera.deviations[camera.names.index(name)] for name in names} == dict(
        zip(names, SD[:8].tolist(), strict=True)
    )
    assert camera.deviations[camera.names.index("p2")] == 0
    assert CALIBRATED.as_camera(weighted=False).is_held
    # What the images do not know better stays as the stars have found it: k3 alone hardly shows in a block.
    block = simulate(strips=2, photos_per_strip=4, seed=2, cameras=[camera], start_cameras=[camera]).block
    result = adjust(block)
    assert result.converged
    found, places = result.cameras[0], [camera.names.index(name) for name in names]
    assert (found.sd[places] <= SD[:8] * max(1.0, np.sqrt(result.covariance_scale)) * (1 + 1e-9)).all()
    assert found.redundancy[places].sum() > 0
    assert (found.redundancy[places] < 1).all()
