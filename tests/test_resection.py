"""Resection without initial values: poses, covariances, priors, degenerate configurations, input."""

from __future__ import annotations

import doctest
import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, chi2

import photogram.adjustment.resection
from message_codes import raises
from photogram import AdjustmentError, InputError, RankError, Spheroid, resect
from photogram.network import project, rotation_matrix

BENCH = Path(__file__).parents[1] / "benches" / "resect_random.py"
GROUND = np.array(
    [[0.0, 0, 10], [800, 50, 20], [750, 900, 0], [30, 820, 40], [400, 420, 5], [600, 300, 60], [150, 500, 90]]
)
STATION, ANGLES, C = np.array([390.0, 430.0, 1500.0]), np.array([0.02, -0.03, 1.5]), -152.0


def view(points, station=STATION, angles=ANGLES, c=C, **kind):
    count = len(points)
    return project(
        points, np.tile(station, (count, 1)), np.tile(angles, (count, 1)), np.full(count, c), **kind
    )


# Random photos


@pytest.fixture(scope="module")
def bench():
    """Load the script of the 10,000 photos."""
    return runpy.run_path(str(BENCH))


def test_random_photos_lie_within_three_sigma(bench):
    """Criterion: e^T Q^-1 e not above the 99.73 % point of chi-square with six degrees of freedom."""
    count = 1000
    values = np.array([bench["outcome"](case).value for case in bench["cases"](count, seed=77)])
    beyond = int((values > chi2.ppf(0.9973, 6)).sum())
    assert beyond <= binom.ppf(0.9999, count, 0.0027)
    for percent in (0.1, 0.5, 0.9):
        share = (values <= chi2.ppf(percent, 6)).mean()
        assert share == pytest.approx(percent, abs=4 * np.sqrt(percent * (1 - percent) / count))


def test_covariance_with_weighted_control_agrees_with_monte_carlo():
    random = np.random.default_rng(4)
    object_sd = np.array([0.3, 0.2, 0.4])
    exact = view(GROUND)
    squares, tests, errors, cofactors = [], [], [], []
    for _ in range(400):
        photo = resect(
            GROUND + object_sd * random.normal(size=GROUND.shape),
            exact + random.normal(0.0, 0.010, exact.shape),
            C,
            image_sd=0.010,
            object_sd=object_sd,
        )
        error = np.concatenate([photo.position - STATION, photo.attitude - ANGLES])
        squares.append(error @ np.linalg.solve(photo.cofactors, error))
        tests.append(photo.standardized)
        errors.append(error)
        cofactors.append(photo.cofactors)
        assert photo.degrees_of_freedom == 8
        total = photo.redundancy.sum() + photo.point_redundancy.sum() + photo.pose_redundancy.sum()
        assert total == pytest.approx(8, abs=1e-6)
    assert np.mean(squares) == pytest.approx(6.0, abs=4 * np.sqrt(12 / 400))
    assert np.mean(np.square(tests)) == pytest.approx(1.0, abs=0.1)
    sd = np.sqrt(np.mean([np.diagonal(each) for each in cofactors], axis=0))
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(errors), axis=0)), sd, rtol=0.15)


# Conventions


@pytest.mark.parametrize("c", [-152.0, 152.0])
@pytest.mark.parametrize("photo_to_ground", [False, True])
@pytest.mark.parametrize("angles", [(0.02, -0.03, 1.5), (0.4, -0.3, -2.9), (-2.5, 0.9, 0.3)])
def test_exact_photos_give_exact_poses(c, photo_to_ground, angles):
    # Points in front of the camera wherever it looks.
    to_photo = rotation_matrix(np.array(angles)[np.newaxis])[0]
    to_photo = to_photo.T if photo_to_ground else to_photo
    seen = np.column_stack([GROUND[:, :2] - 400.0, -1200.0 - 5 * GROUND[:, 2]])
    points = STATION + seen @ to_photo
    xy = view(points, angles=np.array(angles), c=c, photo_to_ground=photo_to_ground)
    photo = resect(points, xy, c, photo_to_ground=photo_to_ground)
    np.testing.assert_allclose(photo.position, STATION, rtol=0, atol=1e-7)
    np.testing.assert_allclose(photo.attitude, angles, rtol=0, atol=1e-10)
    assert (photo.status, photo.alternatives, photo.messages) == ("converged", [], [])


def test_geographic_space():
    spheroid = Spheroid.wgs84()
    station = np.array([np.radians(7.7), np.radians(48.5), 1650.0])
    points = station + (GROUND - STATION) / np.array([4.2e6, 6.37e6, 1.0])
    xy = view(points, station=station, spheroid=spheroid)
    photo = resect(points, xy, C, spheroid=spheroid, image_sd=0.005)
    assert (np.abs(photo.position - station) < [1e-13, 1e-13, 1e-6]).all()
    np.testing.assert_allclose(photo.attitude, ANGLES, rtol=0, atol=1e-10)
    rectangular = resect(GROUND, view(GROUND), C, image_sd=0.005)
    # The height and the angles mean the same in both spaces, the curvature of the Earth apart.
    variances = [np.diagonal(each.cofactors)[2:] for each in (photo, rectangular)]
    np.testing.assert_allclose(*variances, rtol=0.05)


def test_covariances_scale_with_the_variance_of_unit_weight():
    noisy = view(GROUND) + np.random.default_rng(3).normal(0.0, 0.01, (7, 2))
    photo = resect(GROUND, noisy, C, image_sd=0.01)
    assert photo.variance_of_unit_weight == pytest.approx(photo.weighted_sum_of_squares / 8)
    np.testing.assert_allclose(photo.covariance, photo.cofactors * photo.variance_of_unit_weight)
    doubled = resect(GROUND, noisy, C, image_sd=0.02)
    np.testing.assert_allclose(doubled.covariance, photo.covariance, rtol=1e-4)
    np.testing.assert_allclose(doubled.cofactors, 4 * photo.cofactors, rtol=1e-4)
    np.testing.assert_allclose(photo.redundancy.sum(), 8.0)


# Priors


def test_a_fixed_position_stays_and_a_weighted_one_is_an_observation():
    noisy = view(GROUND) + np.random.default_rng(3).normal(0.0, 0.01, (7, 2))
    known = STATION + np.array([3.0, -2.0, 1.0])
    fixed = resect(GROUND, noisy, C, position=known, position_sd=0.0)
    assert fixed.position.tolist() == known.tolist()
    assert (fixed.cofactors[:3] == 0).all()
    free = resect(GROUND, noisy, C)
    weighted = resect(GROUND, noisy, C, position=known, position_sd=free.sd[:3])
    assert (np.diagonal(weighted.cofactors) < np.diagonal(free.cofactors)).all()
    assert ((weighted.pose_redundancy[:3] > 0) & (weighted.pose_redundancy[:3] < 1)).all()
    assert weighted.degrees_of_freedom == free.degrees_of_freedom + 3


def test_known_angles_may_be_whole_turns_away():
    turned = ANGLES + np.array([0.0, 0.0, 4 * np.pi])
    photo = resect(GROUND, view(GROUND), C, attitude=turned, attitude_sd=0.01)
    np.testing.assert_allclose(photo.attitude, turned, rtol=0, atol=1e-9)


def test_two_points_suffice_with_a_known_pose():
    photo = resect(
        GROUND[:2], view(GROUND[:2]), C,
        position=STATION + 1.0, position_sd=2.0, attitude=ANGLES + 0.01, attitude_sd=0.02,
    )  # fmt: skip
    assert photo.converged
    assert photo.degrees_of_freedom == 4
    np.testing.assert_allclose(photo.residuals, 0.0, atol=1e-3)


def test_a_known_pose_with_the_points_behind_it_is_refused():
    """The equations hold for what is behind the camera as well."""
    up = ANGLES + np.array([np.pi, 0.0, 0.0])
    known = {"position": STATION, "position_sd": 0.0, "attitude": up, "attitude_sd": 0.0}
    seen_there = view(GROUND, angles=up)
    with pytest.raises(AdjustmentError, match="in front of the camera"):
        resect(GROUND, seen_there, C, **known)


def test_a_prior_chooses_among_the_poses_of_three_points():
    triangle = np.array([[100.0 * np.cos(t), 100.0 * np.sin(t), 0.0] for t in (0.0, 1.8, 3.9)])
    station = np.array([0.0, 0.0, 300.0])
    xy = view(triangle, station=station)
    photo = resect(triangle, xy, C)
    poses = [photo.position, *(other.position for other in photo.alternatives)]
    assert len(poses) == 4
    assert (photo.messages[0].code, photo.messages[0].phrase.fields["n"]) == ("resection.alternatives", 3)
    assert photo.messages[-1].code == "resection.no-redundancy"
    for pose in poses:
        chosen = resect(triangle, xy, C, position=pose, position_sd=1.0)
        np.testing.assert_allclose(chosen.position, pose, rtol=0, atol=1e-4)
        assert chosen.alternatives == []


# Degenerate configurations


def test_too_few_points_and_points_on_a_line():
    with pytest.raises(RankError, match="at least three points") as caught:
        resect(GROUND[:2], view(GROUND[:2]), C, point_ids=["A", "B"])
    assert caught.value.points == ["A", "B"]
    line = np.outer(np.linspace(0, 1, 6), [300.0, 200.0, 10.0])
    with pytest.raises(RankError, match="on one line"):
        resect(line, view(line), C)


def test_the_danger_cylinder_is_named():
    triangle = np.array([[100.0 * np.cos(t), 100.0 * np.sin(t), 0.0] for t in (0.0, 1.8, 3.9)])
    station = np.array([100.0 * np.cos(0.7), 100.0 * np.sin(0.7), 300.0])
    with pytest.raises(RankError, match="danger cylinder"):
        # A known, but free, pose is the start; the other solutions are excluded by nothing else.
        resect_from(triangle, station)
    near = station * [1.001, 1.001, 1.0]
    photo = resect(triangle, view(triangle, station=near), C, position=near, position_sd=50.0)
    assert any("from the danger cylinder" in str(message) for message in photo.messages)
    four = np.vstack([triangle, [50.0, -20.0, 30.0]])
    free = resect(four, view(four, station=station), C)
    assert (free.outside_danger_cylinder, free.messages) == (None, [])


def resect_from(points, station):
    """Resect with the true pose as start."""
    observed = photogram.adjustment.resection.Observed(
        points, 0.0, view(points, station=station), 0.01, C, None
    )
    start = np.concatenate([station, ANGLES])
    return photogram.adjustment.resection.solve(observed, start=start, limit=1e-5, max_iterations=50)


def test_images_that_no_position_explains():
    # The point in the middle of a flat triangle cannot be seen far beside its base.
    triangle = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [50.0, 5.0, 0.0]])
    with pytest.raises(AdjustmentError, match="at least one position must see the points"):
        resect(triangle, [[0.0, 0.0], [10.0, 0.0], [5.0, 80.0]], C)


# Input


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"object_points": GROUND[:3]}, r"object_points: must have the shape .*, got \(3, 3\)"),
        ({"object_points": GROUND * np.nan}, "error.finite"),
        ({"image_sd": 0.0}, "error.positive"),
        ({"image_sd": -1.0}, "error.not-negative"),
        ({"object_sd": np.inf}, "error.finite"),
        ({"principal_distance": 0.0}, "error.not-zero"),
        ({"position": [1.0, 2.0]}, r"position: must have the shape"),
        ({"position": [1.0, 2.0, np.nan]}, "error.finite"),
        ({"position_sd": 1.0}, "resection.value-missing"),
        ({"point_ids": ["A"]}, "error.count"),
        ({"max_iterations": 0}, "error.positive"),
        ({"max_iterations": 2**64}, "max_iterations: must be an integer"),
        ({"max_iterations": "9"}, "max_iterations: must be an integer"),
        ({"tolerance": None}, "tolerance: must be a number"),
        ({"tolerance": np.nan}, "error.positive"),
        ({"principal_distance": "150"}, "principal_distance: must be a number"),
        ({"principal_distance": 10**400}, "principal_distance: must be a number"),
        ({"attitude": [0.0, np.nan, 0.0]}, "error.finite"),
        ({"attitude": "north"}, "attitude: must be an array of numbers"),
        ({"image_xy": None}, "image_xy: must be an array"),
        ({"image_xy": np.ma.masked_all((7, 2))}, "image_xy: must not have masked values"),
        ({"object_sd": 1j}, "object_sd: must be an array of numbers"),
        ({"point_ids": 7}, "point_ids: must be a list of names"),
    ],
)
def test_wrong_input_is_named(change, message):
    values = {"object_points": GROUND, "image_xy": view(GROUND), "principal_distance": C, **change}
    with raises(InputError, message):
        resect(**values)


def test_the_example_of_the_docstring():
    assert doctest.testmod(photogram.adjustment.resection).failed == 0


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("object_points", None), ("object_points", "points.csv"), ("object_points", [[1, 2], [3]]),
        ("image_xy", 1.0), ("image_xy", None), ("image_xy", [["a", "b"]] * 5), ("principal_distance", None),
        ("principal_distance", "152"), ("principal_distance", 1j), ("image_sd", "0.01"), ("object_sd", None),
        ("position", "here"), ("position_sd", None), ("attitude", [1, 2]), ("attitude", [np.nan] * 3),
        ("spheroid", "wgs84"), ("point_ids", [None] * 5), ("point_ids", "12345"), ("max_iterations", 1.5),
        ("tolerance", "small"),
    ],
)  # fmt: skip
def test_arguments_of_another_type(argument, value):
    ground = np.array([[0.0, 0, 10], [800, 50, 20], [750, 900, 0], [30, 820, 40], [400, 420, 5]])
    station, angles = np.array([390.0, 430.0, 1500.0]), np.array([0.02, -0.03, 1.5])
    xy = project(ground, np.tile(station, (5, 1)), np.tile(angles, (5, 1)), np.full(5, -152.0))
    arguments = {"object_points": ground, "image_xy": xy, "principal_distance": -152.0}
    assert resect(**arguments).converged
    with pytest.raises(InputError, match=argument):
        resect(**{**arguments, argument: value})


def test_masks_of_a_resection_are_not_ignored():
    ground = np.ma.array(np.arange(15.0).reshape(5, 3))
    ground[2, 1] = np.ma.masked
    with pytest.raises(InputError, match="object_points: must not have masked values"):
        resect(ground, np.ones((5, 2)), -152.0)
