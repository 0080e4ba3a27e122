"""A camera calibrated by stars is one that blocks take, with its covariance."""

from dataclasses import replace

import numpy as np
import pytest
import star_plates

from message_codes import as_check, coded
from photogram import InputError, adjust, camera_from, simulate
from photogram.stellar import INDEX, NAMES, UNITS, SkyCamera, calibrate, camera_document

VALUES = np.array([8000.0, 8010.0, 6010.0, 5990.0, -0.02, 0.004, -3e-4, 1e-4, -2e-4])
SD = np.array([0.5, 0.5, 0.8, 0.8, 2e-4, 2e-4, 1e-5, 1e-5, 0.0])
"""p2 was held."""
_FACTOR = np.tril(np.random.default_rng(4).uniform(-0.5, 0.5, (9, 9)), -1) + np.eye(9)
_CORRELATED = _FACTOR @ _FACTOR.T / np.sqrt(np.outer(*[np.diag(_FACTOR @ _FACTOR.T)] * 2))
CALIBRATED = SkyCamera(VALUES, _CORRELATED * np.outer(SD, SD))


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
    names = [name for name in CALIBRATED.names if name != "p2"]
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


@pytest.mark.parametrize("form", ["published", "scale first", "scale last", "one scale"])
def test_a_plate_has_the_images_of_its_calibration_and_its_covariance(plate, form):
    options = {
        "published": {"as_published": True},
        "scale last": {"distortion_first": 0.3},
        "one scale": {"common_scale": True},
    }
    problem = replace(plate, options=replace(plate.options, **options.get(form, {})))
    result = calibrate(problem)
    camera = result.as_camera("plate")
    own = result.combined or result
    parameters = own.solved.parameters
    # What the calibration sees in standard coordinates is seen in the axes m, n, q of an attitude.
    standard = star_plates.standard_coordinates(own.problem, parameters, own.solved.places)
    turned = np.empty((len(standard), 3))
    for group in range(3):
        chosen = own.problem.image_groups == group
        turned[chosen] = standard[chosen] @ star_plates.matrix(parameters[3 * group : 3 * group + 3]).T
    images = camera.project(turned * [1.0, -1.0, -1.0])
    expected = 1000.0 * star_plates.images(own.problem, parameters, own.solved.places)
    np.testing.assert_allclose(images, expected, atol=1e-10)
    back = camera.rays(images)
    np.testing.assert_allclose(
        back, turned * [1, -1, -1] / np.linalg.norm(turned, axis=1)[:, None], atol=1e-12
    )
    # Every variance and covariance, in mm.
    names, found = camera.covariance
    known = [name for name in NAMES[9:22] if own.covariance[INDEX[name], INDEX[name]] > 0]
    assert [{"c": "cx", "c_y": "cy"}.get(name, name) for name in names] == known
    powers = [
        {"rad": 0, "m": 1}[unit] if unit in ("rad", "m") else int(unit[2:]) for unit in map(UNITS.get, known)
    ]
    unit = 1000.0 ** np.array(powers, float)
    rows = [INDEX[name] for name in known]
    np.testing.assert_allclose(found, own.covariance[np.ix_(rows, rows)] * np.outer(unit, unit), rtol=1e-12)
    assert (camera.parameters["c_y"] == 0) == (form == "one scale")


def test_cameras_are_read_from_the_files_of_calibrations(plate, tmp_path):
    result, file = calibrate(plate), tmp_path / "camera.json"
    file.write_bytes(camera_document(result))
    read, own = camera_from(file, "plate"), result.as_camera("plate")
    assert (read.model, read.name, read.parameters) == (own.model, own.name, own.parameters)
    np.testing.assert_array_equal(read.covariance[1], own.covariance[1])
    assert camera_from(str(file), weighted=False).is_held
    file.write_bytes(CALIBRATED.to_json())
    assert camera_from(file).model == "full_opencv"
    for content, message in (
        (b'{"kind": "report"}', coded("error.choice", value="report", names=["brown camera", "sky camera"])),
        (b'{"nonorthogonality_rad": 0.0}', coded("stars.correction")),
        (b"[1", as_check("JSON")),
        (b"[1]", coded("error.at", what="error.document")),
        (b'{"kind": "brown camera"}', coded("error.at", what="error.document")),
    ):
        file.write_bytes(content)
        with pytest.raises(InputError, check=message):
            camera_from(file)


def test_a_plate_camera_is_a_prior_of_a_block(plate):
    """With the images of the block the camera is known better than before, never worse."""
    camera = calibrate(plate).as_camera("plate")
    simulation = simulate(
        strips=2, photos_per_strip=4, frame_size=90.0, seed=3, cameras=[camera], start_cameras=[camera]
    )
    result = adjust(simulation.block)
    assert result.converged
    names, prior = camera.covariance
    rows = [camera.names.index(name) for name in names]
    found, given = result.cameras[0].covariance[np.ix_(rows, rows)], np.asarray(prior)
    scale = 1 / np.sqrt(np.diag(given))
    gain = given - found / result.covariance_scale
    assert np.linalg.eigvalsh(gain * np.outer(scale, scale)).min() > -1e-9
    assert 0 < result.cameras[0].redundancy.sum() < len(names)
    assert result.variance_of_unit_weight == pytest.approx(1.0, abs=0.3)
