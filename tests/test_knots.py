"""Splined cameras: knots beside the parameters, as mrcal has them."""

import pickle

import numpy as np
import pytest

from golden_data import golden
from message_codes import raises
from photogram import Attitudes, Block, Camera, InputError, adjust
from photogram.network.passages import beyond_knots

CORE = {"fx": 700.0, "fy": 705.0, "cx": 640.0, "cy": 480.0}
SPLINE = {"order": 3, "nx": 11, "ny": 8, "fov_x_deg": 120.0}


@pytest.fixture
def knots():
    return np.random.default_rng(5).normal(0.0, 0.02, (8, 11, 2))


@pytest.fixture
def camera(knots):
    return Camera("splined_stereographic", CORE | SPLINE, knots=knots)


def looking(rays):
    """Return rays in axes of vision as photos have them."""
    return np.asarray(rays) * [1, -1, -1]


def test_images_and_partials_are_those_of_mrcal():
    cases = golden("targets", "splined.json")["projections"]
    for case in [each for each in cases if isinstance(each["knots"], list)]:
        words = dict(each.split("=") for each in case["model"].replace("fov_x_deg", "fov").split("_")[3:])
        shape, fov = (int(words["Ny"]), int(words["Nx"])), float(words["fov"])
        camera = Camera(
            "splined_stereographic",
            dict(zip(("fx", "fy", "cx", "cy"), case["core"], strict=True))
            | {"order": int(words["order"]), "nx": shape[1], "ny": shape[0], "fov_x_deg": fov},
            knots=np.reshape(case["knots"], (*shape, 2)),
        )
        u = looking(case["rays"])
        images, by_ray, by_values = camera.partials(u)
        np.testing.assert_allclose(images, case["images"], atol=1e-9, rtol=0)
        np.testing.assert_array_equal(camera.project(u), images)
        largest = np.abs(case["by_ray"]).max()
        np.testing.assert_allclose(looking(by_ray), case["by_ray"], atol=1e-10 * largest, rtol=0)
        # Of mrcal: fx, fy, cx, cy, knots; here constants stand between.
        own = np.delete(by_values, [4, 5, 6, 7], axis=2)
        expected = np.zeros_like(own)
        for row, pair in enumerate(case["by_parameters"]):
            for axis, listed in enumerate(pair):
                numbers, values = np.transpose(listed)
                expected[row, axis, numbers.astype(int)] = values
        np.testing.assert_allclose(own, expected, atol=1e-10 * np.abs(expected).max(), rtol=0)
        back = camera.rays(images)
        np.testing.assert_allclose(back, u / np.linalg.norm(u, axis=1, keepdims=True), atol=1e-12)


def test_partials_by_knots_are_those_that_their_names_say(camera, knots):
    u = looking([[0.3, -0.2, 1.0]])
    _, _, by_values = camera.partials(u)
    names = [*camera.names, *camera.knot_names]
    assert by_values.shape == (1, 2, len(names))
    assert names[8:12] == ["dx_0_0", "dy_0_0", "dx_1_0", "dy_1_0"]
    assert names[-1] == "dy_10_7"
    moved = knots.copy()
    moved[4, 6, 1] += 1.0
    change = camera.replace(knots=moved).project(u) - camera.project(u)
    np.testing.assert_allclose(change[0], by_values[0, :, names.index("dy_6_4")], atol=1e-9)
    assert abs(change[0, 1]) > 1


def test_without_displacements_it_is_stereographic():
    plain = Camera("splined_stereographic", CORE | SPLINE)
    stereographic = Camera("stereographic", CORE)
    u = looking(np.random.default_rng(1).normal(size=(50, 3)))
    np.testing.assert_allclose(plain.project(u), stereographic.project(u), rtol=1e-13)
    np.testing.assert_allclose(plain.rays(plain.project(u)), stereographic.rays(plain.project(u)), atol=1e-12)


def test_what_lies_beyond_the_knots_is_told(camera):
    """Of order 3 an image has two knots on either side: i in 1 .. nx - 2, j in 1 .. ny - 2."""
    per_place = (11 - 3) / (4 * np.tan(np.radians(30)))
    ends = np.array([(11 - 1) / 2 - 1, (8 - 1) / 2 - 1]) / per_place
    places = np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1]]) * ends
    square = (places**2).sum(axis=1, keepdims=True)
    for part, told in ((0.999, False), (1.001, True)):
        own = part * places
        u = looking(np.column_stack([4 * own, 4 - part**2 * square]))
        assert (beyond_knots(camera.parameters, u) == told).all()


def test_cameras_with_knots_are_values(camera, knots):
    assert camera == pickle.loads(pickle.dumps(camera))
    assert camera != camera.replace(knots=2 * knots)
    assert camera.is_held
    assert not camera.replace(knot_sd=[0.2, 0.1]).is_held
    assert "11 x 8, fixed" in repr(camera)
    with pytest.raises(ValueError, match="read-only"):
        camera.knots[0, 0, 0] = 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"order": 4}, "error.whole-range"),
        ({"nx": 3}, "error.whole-range"),
        ({"ny": 8.5}, "error.whole-range"),
        ({"fov_x_deg": 360.0}, "error.range"),
        ({"nx": 12}, r"knots of camera .*: must have the shape \(8, 12, 2\), got \(8, 11, 2\)"),
    ],
)
def test_constants_that_are_none_of_a_spline_are_refused(knots, changes, message):
    with raises(InputError, message):
        Camera("splined_stereographic", CORE | SPLINE | changes, knots=knots)


def test_knots_of_other_models_and_their_deviations_are_refused(knots, camera):
    with raises(InputError, "error.not-applicable"):
        Camera("pinhole", CORE, knots=knots)
    with raises(InputError, "error.requires"):
        Camera("pinhole", CORE, knot_sd=0.1)
    with raises(InputError, "error.not-negative"):
        camera.replace(knot_sd=-1.0)
    with raises(InputError, "block.knot-sd"):
        camera.replace(knot_sd=[np.inf, 0.1])
    with raises(InputError, "error.finite"):
        camera.replace(knots=np.full((8, 11, 2), np.nan))
    with raises(InputError, "error.missing"):
        Camera("splined_stereographic", CORE | {"order": 3, "nx": 11, "ny": 8})


def test_a_block_is_adjusted_through_a_camera_with_knots(camera):
    positions = np.array([[-0.3, 0.1, 2.0], [0.4, -0.2, 2.2], [0.0, 0.3, 1.8]])
    turns = np.array([[0.1, -0.2, 0.3], [-0.15, 0.1, 1.4], [0.05, 0.2, -0.6]])
    points = np.stack(np.meshgrid(np.linspace(-1, 1, 6), np.linspace(-0.8, 0.8, 5), [0.0]), -1).reshape(-1, 3)
    photos, own = np.divmod(np.arange(3 * len(points)), len(points))
    block = Block(
        photo_positions=positions,
        photo_attitudes=turns,
        point_positions=points,
        point_sd=0.0,
        image_photos=photos,
        image_points=own,
        image_xy=np.zeros((len(photos), 2)),
        image_sd=1.0,
        cameras=[camera.replace(name="splined")],
        photo_cameras=0,
    )
    turned = Attitudes.of("omega_phi_kappa", turns).matrices[photos]
    xy = camera.project(np.einsum("mji,mj->mi", turned, points[own] - positions[photos]))
    found = adjust(block.replace(image_xy=xy, photo_positions=positions + 0.02, photo_attitudes=turns + 0.02))
    np.testing.assert_allclose(found.photo_positions, positions, atol=1e-9)
    np.testing.assert_allclose(found.photo_attitudes, turns, atol=1e-9)
    assert found.cameras[0].camera.knots is not None
