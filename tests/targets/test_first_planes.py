"""Homographies, focal lengths and poses of planes, and which lens shows boards as planes."""

import numpy as np
import pytest
from given_targets import golden
from golden_boards import left, wide

from photogram import Camera
from photogram.targets.first_camera import misfits, rays_of, trials
from photogram.targets.first_camera import wide as best_field
from photogram.targets.sightings import (
    Sightings,
    focal_lengths,
    frontal_tilts,
    homographies,
    poses,
    ray_homographies,
)


@pytest.fixture(scope="module")
def thirteen():
    return Sightings.of_corners(*left())


def test_homographies_and_focal_lengths_are_the_golden_ones(thirteen):
    known = golden("opencv_left")["left"]
    found = homographies(thirteen.coordinates, thirteen.xy)
    found /= found[:, 2:, 2:]
    np.testing.assert_allclose(found, known["homographies"], rtol=1e-8)
    start = known["start"]
    focal = focal_lengths(found, np.array(start["principal_point"]))
    np.testing.assert_allclose(focal, [start["fx"], start["fy"], start["f_single"]], rtol=1e-8)


def test_poses_of_homographies_are_the_golden_ones(thirteen):
    start = golden("opencv_left")["left"]["start"]
    parameters = {"fx": start["fx"], "fy": start["fy"], "cx": 319.5, "cy": 239.5}
    matrix = np.array([[start["fx"], 0, 319.5], [0, start["fy"], 239.5], [0, 0, 1]])
    found = np.linalg.inv(matrix) @ homographies(thirteen.coordinates, thirteen.xy)
    rays = rays_of(Camera("pinhole", parameters), thirteen.xy)
    towards = np.einsum("pi,pi->p", rays[:, 0], found[:, :, 2])
    made = poses(found * np.sign(towards)[:, None, None])
    np.testing.assert_allclose(made[:, :3, :3], start["R"], atol=1e-9)
    np.testing.assert_allclose(made[:, :3, 3], start["t"], rtol=1e-8)
    # Homographies of rays weigh the same corners a little otherwise.
    of_rays = poses(ray_homographies(thirteen.coordinates, rays))
    np.testing.assert_allclose(of_rays[:, :3, :3], start["R"], atol=0.02)


@pytest.mark.parametrize(
    ("family", "field", "angle"),
    [
        ("fisheye", 140, 15.0),
        ("fisheye", 150, 9.0),
        ("fisheye", 160, 25.7),
        ("stereographic", 140, 25.0),
        ("stereographic", 150, 9.1),
        ("stereographic", 160, 13.5),
    ],
)
def test_misfits_of_trial_fields_are_those_of_the_specification(family, field, angle):
    seen = Sightings.of_corners(*wide(step=3))
    half = np.radians(field) / 2
    f = 3008 / (half if family == "fisheye" else 2 * np.tan(half / 2))
    camera = Camera(family, {"fx": f, "fy": f, "cx": 3007.5, "cy": 2007.5})
    found = np.median(misfits(seen, rays_of(camera, seen.xy)))
    assert found * 1e4 == pytest.approx(angle, abs=0.06)


def test_a_wide_lens_is_found_among_families():
    seen = Sightings.of_corners(*wide(step=3))
    found = [best_field(seen, (6016, 4016), family) for family in ("fisheye", "stereographic")]
    fields = [
        np.degrees(6016 / found[0].camera.scale),
        np.degrees(4 * np.arctan(6016 / 4 / found[1].camera.scale)),
    ]
    assert all(145 < field < 157 for field in fields)
    assert all(each.camera.model != "pinhole" for each in trials(seen, (6016, 4016)))


def test_focal_lengths_that_nothing_says_are_missing():
    """Boards that are parallel to the image."""
    flat = np.array([[[700.0, 0, 100], [0, 700, 80], [0, 0, 1]], [[500.0, 0, 300], [0, 500, 20], [0, 0, 1]]])
    fx, fy, f = focal_lengths(flat, np.array([320.0, 240.0]))
    assert np.isnan([fx, fy, f]).all()


def test_tilts_count_from_parallel_to_the_image():
    made = np.tile(np.eye(4), (2, 1, 1))
    tilt = np.radians(20)
    made[1, 1:3, 1:3] = [[-np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), -np.cos(tilt)]]
    np.testing.assert_allclose(frontal_tilts(made), [0, tilt], atol=1e-12)
