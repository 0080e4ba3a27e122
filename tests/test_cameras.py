"""Cameras with unknown parameters in blocks: what may be given, and what has become of them."""

import copy
import json
import pickle
import re

import numpy as np
import pytest

from example_scripts import load
from message_codes import as_check, raises
from photogram import AdjustmentError, Block, Camera, InputError, RankError, adjust, predict
from photogram.adjustment.undetermined import in_words
from photogram.giant import Project
from photogram.network import project
from photogram.network.rays import Rays
from photogram.words import Phrase

FREE = np.inf


@pytest.fixture(scope="module")
def example():
    return load("self_calibration")


@pytest.fixture(scope="module")
def block(example):
    return example.measured()


@pytest.fixture(scope="module")
def result(block):
    return adjust(block)


def test_a_camera_is_found_from_its_principal_distance_alone(example, result):
    assert result.converged
    camera = result.cameras[0]
    assert (camera.name, camera.photos, camera.images) == ("24 mm lens", 12, int(result.used_images.sum()))
    rows = camera.estimated
    errors = (camera.values - example.TRUTH.values)[rows]
    covariance = camera.covariance[np.ix_(rows, rows)]
    form = errors @ np.linalg.solve(covariance, errors)
    assert form < 26.1  # chi-square of 8, 0.1 percent
    assert 0.85 < np.sqrt(result.variance_of_unit_weight) < 1.15
    weights = result.redundancy.sum() + result.point_redundancy[result.used_points].sum()
    assert weights == pytest.approx(result.degrees_of_freedom)
    np.testing.assert_allclose(camera.sd[rows] ** 2, np.diag(covariance))
    assert (camera.information[rows] * np.diag(camera.cofactors)[rows] > 1).all()


def test_a_camera_for_each_photo_and_one_that_is_held(block, result):
    own = [example_camera(block, "own"), example_camera(block, "shared")]
    cameras = [
        *own,
        block.cameras[0].replace(parameters=result.cameras[0].camera.parameters, sd=0.0, name="held"),
    ]
    of = ["own", *["shared"] * 8, *["held"] * 3]
    mixed = adjust(block.replace(cameras=cameras, photo_cameras=of))
    assert mixed.converged
    assert [each.photos for each in mixed.cameras] == [1, 8, 3]
    assert not mixed.cameras[2].sd.any()
    for each in mixed.cameras[:2]:
        apart = each.values - result.cameras[0].values
        assert (np.abs(apart) < 5 * np.hypot(each.sd, result.cameras[0].sd) + 1e-12).all()
    assert mixed.photo_covariances.shape == (12, 6, 6)
    assert mixed.photo_corrections.shape == (len(mixed.iterations), 12, 6)
    moved = block.photo_positions + mixed.photo_corrections[:, :, :3].sum(axis=0)
    np.testing.assert_allclose(moved, mixed.photo_positions, atol=1e-9)


def example_camera(block, name):
    return block.cameras[0].replace(name=name)


def test_photos_with_cameras_of_their_own_need_no_indices(block):
    cameras = [Camera("perspective", {"c": -24.3}, sd=0.5, unit="mm") for _ in block.photo_ids]
    given = block.replace(cameras=cameras, photo_cameras=None)
    assert given.photo_cameras.tolist() == list(range(12))
    assert given.camera_names[:2] == ["camera 1", "camera 2"]
    table = adjust(given).camera_table()
    assert len(table) == 12
    assert table["sd_given"].tolist() == [0.5] * 12


def test_weights_count(block):
    """Weights that hold a camera are as if it was held; their redundancy numbers are those of priors."""
    truth = adjust(block).cameras[0].camera
    tight = adjust(block.replace(cameras=[truth.replace(sd={"c": 1e-7, "K1": FREE})]))
    held = adjust(block.replace(cameras=[truth.replace(sd={"K1": FREE})]))
    np.testing.assert_allclose(tight.point_positions, held.point_positions, atol=1e-9)
    c, k1 = (truth.names.index(name) for name in ("c", "K1"))
    assert tight.cameras[0].redundancy[c] < 1e-5
    assert tight.cameras[0].redundancy[k1] == 0
    assert tight.degrees_of_freedom == held.degrees_of_freedom
    loose = adjust(block.replace(cameras=[truth.replace(sd={"c": 10.0})]))
    assert loose.cameras[0].redundancy[c] > 0.999


def test_cameras_of_one_block_are_observations_of_another(example):
    """Two blocks together know what the sum of their weights says."""
    first, second = (adjust(example.measured(seed=seed), unit_variance="unity") for seed in (11, 12))
    prior = first.cameras[0].observed()
    rows = first.cameras[0].estimated
    assert prior.prior_covariance.shape == (8, 8)
    both = adjust(example.measured(seed=12).replace(cameras=[prior]), unit_variance="unity")
    camera = both.cameras[0]
    weights = [np.linalg.inv(each.cameras[0].covariance[np.ix_(rows, rows)]) for each in (first, second)]
    expected = np.linalg.inv(sum(weights))
    scale = np.sqrt(np.diag(expected))
    found = camera.covariance[np.ix_(rows, rows)]
    np.testing.assert_allclose(found / np.outer(scale, scale), expected / np.outer(scale, scale), atol=0.02)
    values = expected @ sum(
        weight @ each.cameras[0].values[rows] for weight, each in zip(weights, (first, second), strict=True)
    )
    np.testing.assert_allclose((camera.values[rows] - values) / scale, 0, atol=0.05)
    shares = 1 - np.diag(found @ np.linalg.inv(prior.prior_covariance))
    np.testing.assert_allclose(camera.redundancy[rows], shares, atol=1e-6)
    # Where weights of cameras count they are among the degrees of freedom.
    counted = adjust(both.block)
    sums = both.redundancy.sum() + both.point_redundancy[both.used_points].sum() + camera.redundancy.sum()
    assert sums == pytest.approx(counted.degrees_of_freedom, rel=1e-7)
    pickled = pickle.loads(pickle.dumps(prior))
    np.testing.assert_array_equal(pickled.prior_covariance, prior.prior_covariance)


def test_principal_distances_are_perspective_cameras_that_are_held(small_block):
    distance = float(small_block.principal_distances[0])
    camera = Camera("perspective", {"c": distance})
    same = small_block.replace(principal_distances=None, cameras=[camera])
    ours, theirs = adjust(same), adjust(small_block)
    np.testing.assert_array_equal(ours.point_positions, theirs.point_positions)
    np.testing.assert_array_equal(ours.photo_covariances, theirs.photo_covariances)
    assert theirs.cameras == ()
    assert ours.cameras[0].given.is_held
    # What takes only such cameras takes these.
    np.testing.assert_array_equal(Rays.of(same).directions(), Rays.of(small_block).directions())


def test_what_takes_no_lens_says_so(block, tmp_path):
    camera = "error.value: block.unsupported.camera 24 mm lens brown"
    with pytest.raises(InputError, check=as_check(f"error.at checks: {camera}")):
        Rays.of(block).directions()
    with pytest.raises(InputError, check=as_check(f"error.at GIANT files: {camera}")):
        Project.from_block(block)


def test_predictions_know_the_lens(result):
    from photogram.adjustment.prediction import at_adjusted, computed_images

    plan = at_adjusted(result)
    # Residuals are those of corrected coordinates.
    np.testing.assert_allclose(
        plan.image_xy - computed_images(plan), result.residuals[result.used_images], atol=1.5e-4
    )
    predicted = predict(plan)
    sd = np.sqrt(np.diag(result.cameras[0].cofactors))
    np.testing.assert_allclose(predicted.cameras[0].sd, sd, rtol=1e-4, atol=1e-20)


def test_pixels_are_named(example, block):
    pixels = 1000 / 6
    xy = block.image_xy * [pixels, -pixels] + [3000, 2000]
    camera = Camera("radial", {"f": 25 * pixels, "cx": 3000, "cy": 2000}, sd=FREE)
    given = block.replace(cameras=[camera], image_xy=xy, image_sd=np.array(0.2))
    assert given.image_unit == "px"
    result = adjust(given)
    assert result.converged
    assert "residual_x_px" in result.image_table()
    report = result.report()
    assert "rms of image residuals" in report
    assert not re.search(r"\bum\b", report)
    document = json.loads(result.to_json())
    assert document["units"]["residual_px"] == "px"
    assert "residual_px" in document["observations"][0]
    assert document["cameras"][0]["image_unit"] == "px"
    f = result.cameras[0]
    assert abs(f.value("f") - 24.3 * pixels) < 0.01 * f.value("f")


def test_tables_name_cameras(block):
    photos = {
        "photo": block.photo_ids,
        **dict(zip("XYZ", block.photo_positions.T, strict=True)),
        **dict(zip(("omega_deg", "phi_deg", "kappa_deg"), np.degrees(block.photo_attitudes).T, strict=True)),
        "camera": ["a", "b"] * 6,
    }
    images = {
        "photo": [block.photo_ids[i] for i in block.image_photos],
        "point": [block.point_ids[i] for i in block.image_points],
        "x_px": block.image_xy[:, 0],
        "y_px": block.image_xy[:, 1],
    }
    cameras = [Camera("brown", {"c": -25.0}, name=name, unit="px") for name in "ab"]
    made = Block.from_tables(photos, images, cameras=cameras, image_sd=1.0)
    assert made.photo_cameras.tolist() == [0, 1] * 6
    assert made.image_unit == "px"
    for wrong, match in (
        ({"principal_distance": -24.0}, "error.exclusive"),
        ({"image_sd": None}, "sd_x_px"),
        ({"cameras": ()}, "error.requires"),
    ):
        with raises(InputError, match):
            Block.from_tables(photos, images, **{"cameras": cameras, "image_sd": 1.0} | wrong)


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ({"model": "barrel"}, "model: must be one of|error.choice"),
        ({"model": 5}, "model: must be one of|error.choice"),
        ({"parameters": {}}, "error.missing"),
        ({"parameters": {"c": 0.0}}, "error.not-zero"),
        ({"parameters": {"c": -24.0, "k1": 0.0}}, "error.unknown"),
        ({"parameters": {"c": np.nan}}, "error.not-zero"),
        ({"parameters": [1.0]}, "error.table"),
        ({"sd": -1.0}, "error.not-negative"),
        ({"sd": {"f": 1.0}}, "error.unknown"),
        ({"sd": {"r0": 1.0}}, "camera.constant"),
        ({"covariance": 5}, "error.kind"),
        ({"covariance": (["c"], np.eye(2))}, "must have the shape"),
        ({"covariance": (["c", "c"], np.eye(2))}, "error.kind"),
        ({"covariance": (["f"], np.eye(1))}, "error.unknown"),
        ({"covariance": (["c", "xp"], np.ones((2, 2)))}, "error.covariance"),
        ({"covariance": (["c"], np.eye(1)), "sd": {"c": 2.0}}, "camera.sd-of-covariance"),
        ({"covariance": (["r0"], np.eye(1))}, "camera.constant"),
        ({"unit": "inch"}, "unit"),
        ({"name": 5}, "name"),
    ],
)
def test_cameras_that_cannot_be(given, match):
    with raises(InputError, match):
        Camera(**{"model": "brown", "parameters": {"c": -24.0}} | given)


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ({"cameras": ()}, "error.requires"),
        ({"cameras": (), "photo_cameras": None}, "principal_distances"),
        ({"principal_distances": np.full(12, -24.0)}, "error.exclusive"),
        ({"cameras": "lens"}, "error.list"),
        ({"cameras": 5}, "error.list"),
        ({"photo_cameras": [0] * 11}, "error.count"),
        ({"photo_cameras": [1] * 12}, "error.absent"),
        ({"photo_cameras": ["lens"] * 12}, "error.absent"),
        ({"photo_cameras": [0.5] * 12}, "error.absent"),
        ({"photo_cameras": 1.5}, "error.list"),
        ({"cameras": [Camera("brown", {"c": -1.0})] * 2, "photo_cameras": None}, "error.missing"),
        ({"cameras": [Camera("brown", {"c": -1.0}, name="x")] * 2}, "error.repeated"),
        (
            {"cameras": [Camera("brown", {"c": -1.0}), Camera("brown", {"c": -1.0}, unit="px")]},
            "one unit",
        ),
    ],
)
def test_blocks_whose_cameras_cannot_be(block, given, match):
    with raises(InputError, match):
        block.replace(**given)


def test_cameras_are_copied_pickled_and_used_alone():
    camera = Camera("brown", {"c": -24.0, "K1": -1e-4}, sd={"c": FREE})
    for same in (pickle.loads(pickle.dumps(camera)), copy.deepcopy(camera), camera.replace()):
        np.testing.assert_array_equal(same.values, camera.values)
        np.testing.assert_array_equal(same.deviations, camera.deviations)
    assert (camera.unit, camera.direction, camera.scale) == ("mm", "backward", 24.0)
    assert [camera.unit_of(name) for name in ("c", "K1", "K2", "P1", "b1")] == [
        "mm",
        "mm^-2",
        "mm^-4",
        "mm^-1",
        "",
    ]
    u = np.array([[0.1, 0.2, -1.0], [-0.3, 0.1, -2.0]])
    xy = camera.project(u)
    np.testing.assert_allclose(camera.rays(xy), u / np.linalg.norm(u, axis=1, keepdims=True), atol=1e-14)
    ideal = project(u, np.zeros((2, 3)), np.zeros((2, 3)), [-24.0, -24.0])
    r2 = (xy**2).sum(axis=1, keepdims=True)
    np.testing.assert_allclose(xy * (1 - 1e-4 * r2), ideal, atol=1e-12)
    with pytest.raises(InputError, match="u: must have the shape"):
        camera.project(np.zeros((2, 2)))


def test_what_is_not_determined_names_the_camera(small_block):
    """Vertical photos, no control: a longer principal distance is a greater flying height."""
    camera = Camera(
        "brown", {"c": float(small_block.principal_distances[0])}, sd={"r0": 0.0, "b1": FREE, "c": FREE}
    )
    seen = np.flatnonzero(small_block.image_photos == 0)
    single = small_block.replace(
        principal_distances=None,
        cameras=[camera.replace(name="unused"), camera.replace(name="flying", sd=0.0)],
        photo_cameras=np.array([1, 1, 1, 1, 0, 0]),
        image_photos=np.concatenate([small_block.image_photos[small_block.image_photos < 4], [4, 5]]),
        image_points=np.concatenate(
            [small_block.image_points[small_block.image_photos < 4], small_block.image_points[seen[:2]]]
        ),
        image_xy=np.concatenate(
            [small_block.image_xy[small_block.image_photos < 4], [[0.0, 1.0], [1.0, 0.0]]]
        ),
        image_sd=np.array(0.01),
    )
    with pytest.raises(RankError) as caught:
        adjust(single)
    assert caught.value.cameras == ["unused"]
    assert "unused" in str(caught.value)


def vertical(names, relief=0.0):
    """Return three vertical photos of known points, some parameters of their camera free."""
    plane = np.array([[x, y, relief * ((x + 2 * y) % 3)] for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0, 2.0)])
    stations = np.array([[0.5, 1.0, 10.0], [1.0, 1.2, 10.0], [1.5, 0.8, 10.0]])
    photos, seen = (each.ravel() for each in np.indices((3, 9)))
    attitudes = np.zeros((3, 3))
    xy = project(plane[seen], stations[photos], attitudes[photos], np.full(27, -100.0))
    return Block(
        photo_ids=["a", "b", "c"],
        photo_positions=stations,
        photo_attitudes=attitudes,
        cameras=[Camera("brown", {"c": -100.0}, sd=dict.fromkeys(names, FREE), name="lens")],
        point_ids=[f"P{k}" for k in range(9)],
        point_positions=plane,
        point_sd=0.0,
        image_photos=photos,
        image_points=seen,
        image_xy=xy,
        image_sd=0.001,
    )


@pytest.mark.parametrize(
    ("names", "cause"),
    [
        (["c"], ["moved.along", "weak.height"]),
        (["xp"], ["moved.across", "weak.point.parallel"]),
    ],
)
def test_what_vertical_photos_of_a_plane_leave_open(names, cause):
    with pytest.raises(RankError) as caught:
        adjust(vertical(names))
    assert caught.value.code == "adjust.undetermined"
    assert all(str(Phrase(code)).split("{")[0][:30] in str(caught.value) for code in cause)
    assert "all 3 photos" in str(caught.value)
    assert (caught.value.photos, caught.value.cameras) == (["a", "b", "c"], ["lens"])


def test_relief_tells_them_apart():
    assert adjust(vertical(["c", "xp", "yp"], relief=1.0)).converged


@pytest.mark.parametrize(
    ("names", "poses", "code"),
    [
        ({"K1", "K2"}, set(), "weak.radial"),
        ({"f"}, {"along", "across"}, "weak.scale"),
        ({"P1", "xp"}, set(), "weak.decentring"),
        ({"K1", "c"}, {"along"}, "weak.distance-terms"),
        ({"b1", "c"}, {"along"}, "weak.affinity"),
        ({"b2"}, {"swing"}, "weak.shear"),
        ({"e7"}, {"tilt"}, None),
    ],
)
def test_combinations_that_have_a_name(names, poses, code):
    cause = in_words(names, poses)
    assert (cause and cause.code) == code


def test_images_beyond_where_a_lens_ends_are_named(example, block):
    """1 + 3 K1 r^2 vanishes at 45.6 mm: what is measured at 60 mm is corrected to what lies nearer."""
    camera = example.TRUTH.replace(parameters={"c": -24.3, "K1": -1.6e-4}, name="barrel")
    xy, sd = block.image_xy.copy(), np.full(block.image_sd.shape, 0.5)
    known = block.replace(cameras=[camera], image_sd=sd)
    assert not any(message.code.startswith("adjust.folded") for message in adjust(known).messages)
    xy[7], sd[7] = [60.0, 0.0], 1e6
    messages = adjust(known.replace(image_xy=xy, image_sd=sd)).messages
    folded = next(message for message in messages if message.code == "adjust.folded.images")
    assert folded.phrase.fields["n"] == 1
    photo, point = block.photo_ids[block.image_photos[7]], block.point_ids[block.image_points[7]]
    assert f"points {point} on photos {photo}; the lens of barrel folds at a radius of 45.64 mm" in str(
        folded
    )


def test_control_beyond_where_a_lens_ends_is_an_error(example, block):
    """Where the point is known its ray is: something is wrong by far more than a measurement."""
    camera = example.TRUTH.replace(parameters={"c": -24.3, "K1": -1.6e-4}, name="barrel")
    xy, sd = block.image_xy.copy(), np.full(block.image_sd.shape, 0.5)
    xy[7], sd[7] = [60.0, 0.0], 1e6
    photo, point = block.image_photos[7], block.image_points[7]
    truth = adjust(block.replace(cameras=[camera], image_sd=np.full(sd.shape, 0.5))).point_positions
    positions, deviations = block.point_positions.copy(), block.point_sd.copy()
    positions[point], deviations[point] = truth[point], 0.01
    known = block.replace(
        cameras=[camera], image_xy=xy, image_sd=sd, point_positions=positions, point_sd=deviations
    )
    with raises(AdjustmentError, "adjust.folded.control") as caught:
        adjust(known)
    of = f"point {block.point_ids[point]} on photo {block.photo_ids[photo]}"
    assert f"{of}; the lens of barrel folds at a radius of 45.64 mm, which becomes 30.43" in str(caught.value)


def test_the_tilts_of_opencv_are_a_rotated_sensor():
    """The documents of OpenCV, written out: R = Ry Rx, projected back to the plane of the lens."""
    tau_x, tau_y, f, c = 0.08, -0.05, np.array([1200.0, 1190.0]), np.array([640.0, 480.0])
    lens = {"k1": -0.1, "k2": 0.02, "p1": 1e-3, "p2": -2e-3, "s1": 1e-3, "s4": 2e-4}
    names = {"fx": f[0], "fy": f[1], "cx": c[0], "cy": c[1]}
    u = np.column_stack([np.random.default_rng(2).uniform(-0.4, 0.4, (20, 2)), -np.ones(20)])
    plain = (Camera("opencv_pinhole", names | lens).project(u) - c) / f
    (sx, sy), (cx, cy) = np.sin([tau_x, tau_y]), np.cos([tau_x, tau_y])
    r = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
    back = np.array([[r[2, 2], 0, -r[0, 2]], [0, r[2, 2], -r[1, 2]], [0, 0, 1]])
    h = np.column_stack([plain, np.ones(20)]) @ (back @ r).T
    tilted = Camera("opencv_tilted", names | lens | {"tau_x": tau_x, "tau_y": tau_y})
    np.testing.assert_allclose(tilted.project(u), f * h[:, :2] / h[:, 2:] + c, atol=1e-9)
    np.testing.assert_allclose(
        tilted.rays(tilted.project(u)), u / np.linalg.norm(u, axis=1)[:, None], atol=1e-12
    )
    straight = Camera("opencv_tilted", names | lens)
    np.testing.assert_allclose(straight.project(u), plain * f + c, atol=1e-10)


@pytest.mark.parametrize("kind", ["frame", "fisheye"])
def test_p3_and_p4_of_agisoft_multiply_the_tangential_terms(kind):
    given = {
        "f": 3000.0,
        "cx": 10.0,
        "cy": -5.0,
        "b1": 1.0,
        "b2": -2.0,
        "k1": -0.05,
        "w": 4000.0,
        "h": 3000.0,
    }
    tangential, p3, p4 = {"p1": 2e-3, "p2": -1e-3}, 0.3, -0.1
    u = np.column_stack([np.random.default_rng(3).uniform(-0.5, 0.5, (20, 2)), -np.ones(20)])
    rho = np.hypot(u[:, 0], u[:, 1])
    ab = u[:, :2] * [1, -1] * (np.arctan(rho) / rho if kind == "fisheye" else np.ones(20))[:, None]
    square = (ab**2).sum(axis=1)
    without = Camera(f"agisoft_{kind}", given).project(u)
    terms = Camera(f"agisoft_{kind}", given | tangential).project(u) - without
    expected = without + terms * (1 + p3 * square + p4 * square**2)[:, None]
    camera = Camera(f"agisoft_{kind}_p4", given | tangential | {"p3": p3, "p4": p4})
    np.testing.assert_allclose(camera.project(u), expected, atol=1e-9)
    np.testing.assert_allclose(camera.rays(expected), u / np.linalg.norm(u, axis=1)[:, None], atol=1e-12)


def test_a_fisheye_sees_behind_its_own_plane():
    """Directions up to 130 degrees from the axis, from two sides of a ring of points."""
    turns = np.radians(np.arange(0.0, 360.0, 24.0))
    heights = np.where(np.arange(len(turns)) % 2 == 0, 0.8, -2.0)
    points = np.column_stack([np.cos(turns), np.sin(turns), heights])
    stations = np.array([[-0.2, 0.0, 0.0], [0.25, 0.1, 0.1], [0.0, -0.2, -0.1]])
    camera = Camera("opencv_fisheye", {"fx": 400.0, "fy": 401.0, "cx": 960.0, "cy": 540.0, "k1": 0.01})
    photos, seen = (each.ravel() for each in np.indices((3, len(points))))
    block = Block(
        photo_ids=["1", "2", "3"],
        photo_positions=stations + 0.005,
        photo_attitudes=np.full((3, 3), 0.01),
        cameras=[camera],
        point_ids=[f"P{i}" for i in range(len(points))],
        point_positions=points,
        point_sd=np.where(np.arange(len(points)) < 4, 1e-4, np.inf)[:, np.newaxis] * np.ones(3),
        image_photos=photos,
        image_points=seen,
        image_xy=camera.project(points[seen] - stations[photos]),
        image_sd=np.full((len(photos), 2), 0.3),
    )
    result = adjust(block)
    assert result.converged
    assert (points[seen] - stations[photos])[:, 2].max() > 0.5
    np.testing.assert_allclose(result.photo_positions, stations, atol=1e-6)
    np.testing.assert_allclose(result.photo_attitudes, 0.0, atol=1e-6)
    assert not any("behind" in str(message) for message in result.messages)


def test_a_standard_deviation_without_a_variance_is_refused():
    with raises(InputError, "camera.large-sd"):
        Camera("simple_radial", {"f": 10.0, "cx": 0.0, "cy": 0.0, "k": 0.0}, sd={"k": 1e200})
