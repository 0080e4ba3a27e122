"""Covariances of anything with anything, and of functions."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from example_scripts import load
from golden_data import golden
from golden_network import free_network
from message_codes import as_check
from photogram import Attitudes, InnerConstraints, InputError, OutOfMemoryError, adjust
from photogram.arguments.arrays import standard_deviations


@pytest.fixture(scope="module")
def small(small_block):
    return adjust(small_block, tolerance=1e-9)


def test_blocks_on_the_diagonal_are_those_of_the_result(small):
    names = [small.block.photo_ids[2], small.block.photo_ids[5]]
    points = [name for name, used in zip(small.block.point_ids, small.used_points, strict=True) if used][3:9]
    covariances = small.covariances()
    selection = [("photo", names), ("point", points)]
    joint = covariances.covariance(selection)
    assert joint.shape == (30, 30)
    np.testing.assert_array_equal(joint, joint.T)
    assert (np.linalg.eigvalsh(joint / np.outer(*[np.sqrt(np.diag(joint))] * 2)) > 0).all()
    for k, name in enumerate(names):
        photo = small.block.photo_ids.index(name)
        expected = small.photo_covariances[photo]
        sd = np.sqrt(np.diag(expected))
        found = joint[6 * k : 6 * k + 6, 6 * k : 6 * k + 6]
        np.testing.assert_allclose(found / np.outer(sd, sd), expected / np.outer(sd, sd), atol=1e-6)
    for k, name in enumerate(points):
        at = 12 + 3 * k
        expected = small.point_covariances[small.block.point_ids.index(name)]
        np.testing.assert_allclose(joint[at : at + 3, at : at + 3], expected, rtol=1e-6, atol=1e-12)
    assert covariances.labels(selection)[6:8] == [("photo", names[1], "X"), ("photo", names[1], "Y")]
    # One with another: a corner of the joint matrix, whichever way it is computed.
    cross = small.covariance(("photo", names[1]), [("point", points)])
    np.testing.assert_allclose(cross, joint[6:12, 12:], rtol=1e-7, atol=1e-12)
    all_points = covariances.covariance(("photo", names[0]), ("point", None))
    assert all_points.shape == (6, 3 * small.used_points.sum())
    assert np.abs(covariances.correlation(("step", names[0]), ("photo", None))).max() <= 1 + 1e-9


def test_a_distance_and_an_angle_by_propagation(small):
    points = [name for name, used in zip(small.block.point_ids, small.used_points, strict=True) if used]
    a, b, c = points[0], points[10], points[20]
    covariances = small.covariances()

    def distance(p, q):
        return np.sqrt(((q - p) ** 2).sum())

    found = covariances.propagate(distance, [("point", a), ("point", b)])
    ends = [small.point_positions[small.block.point_ids.index(name)] for name in (a, b)]
    direction = (ends[1] - ends[0]) / found.value
    partials = np.concatenate([-direction, direction])
    joint = covariances.covariance(("point", [a, b]))
    assert found.standard_deviation == pytest.approx(np.sqrt(partials @ joint @ partials), rel=1e-9)
    np.testing.assert_allclose(found.partials, [partials], atol=1e-12)
    # The same without complex arrays: a norm takes absolute values.
    plain = covariances.propagate(lambda p, q: np.linalg.norm(q - p), [("point", a), ("point", b)])
    assert plain.standard_deviation == pytest.approx(found.standard_deviation, rel=1e-6)

    def angles(p):
        u, v = p[1] - p[0], p[2] - p[0]
        return np.array([np.arctan2(u[1], u[0]) - np.arctan2(v[1], v[0]), u @ v])

    two = small.propagate(angles, ("point", [a, b, c]))
    assert two.value.shape == two.standard_deviation.shape == (2,)
    np.testing.assert_allclose(np.sqrt(np.diag(two.covariance)), two.standard_deviation)


def test_the_bias_of_a_function_is_half_the_trace_of_its_second_derivatives(small):
    point = next(name for name, used in zip(small.block.point_ids, small.used_points, strict=True) if used)
    middle = small.point_positions[small.block.point_ids.index(point)]
    weights = np.array([1.0, 2.0, 3.0])
    found = small.propagate(lambda p: weights @ (p - middle) ** 2, ("point", point), bias=True)
    covariance = small.covariance(("point", point))
    assert found.bias == pytest.approx(np.trace(np.diag(weights) @ covariance), rel=1e-9)
    assert small.propagate(lambda p: p[0], ("point", point)).bias is None


def test_a_relative_pose_by_propagation_knows_of_no_datum():
    expected = golden("network", "free_network.json")["relative_pose_photo5_in_photo1"]
    minimum = adjust(free_network(bars=True), tolerance=1e-9)
    first = Attitudes.of("matrix", np.array([expected["matrix"]])).values("matrix")[0]

    def relative(one, other):
        turned = [
            Attitudes.of("omega_phi_kappa", each[None, 3:]).values("matrix")[0] for each in (one, other)
        ]
        translation = turned[0].T @ (other[:3] - one[:3])
        small = first.T @ turned[0].T @ turned[1]
        rotation = 0.5 * np.array(
            [small[2, 1] - small[1, 2], small[0, 2] - small[2, 0], small[1, 0] - small[0, 1]]
        )
        return np.concatenate([translation, rotation])

    for result in (minimum, minimum.in_datum(InnerConstraints())):
        found = result.propagate(relative, [("photo", "photo1"), ("photo", "photo5")])
        np.testing.assert_allclose(found.value[:3], expected["translation"], atol=1e-8)
        cofactors = np.array(expected["cofactors"])
        scale = np.sqrt(np.outer(*[np.diag(cofactors)] * 2))
        np.testing.assert_allclose(
            found.covariance / result.covariance_scale / scale, cofactors / scale, atol=1e-5
        )


def test_what_has_no_covariance_is_refused(small, monkeypatch):
    point = small.block.point_ids[int(np.flatnonzero(small.used_points)[0])]
    covariances = small.covariances()
    for selection, message in (
        (("points", point), "a selection must be a pair"),
        ("point", "a selection must be a pair"),
        (("point", "nowhere"), "error.absent point nowhere"),
        (("camera", "nothing"), "error.absent camera nothing"),
        ([("photo", 3)], "names of the kind photo"),
    ):
        with pytest.raises(InputError, check=as_check(message)):
            covariances.covariance(selection)
    with pytest.raises(InputError, check=lambda error: error.phrase.fields["message"].code == "error.finite"):
        covariances.propagate(lambda p: p * np.nan, ("point", point))
    with pytest.raises(InputError, check=lambda error: error.code == "covariance.step"):
        covariances.propagate(lambda p: p, ("step", small.block.photo_ids[0]))
    monkeypatch.setattr("photogram.network.core_arrays.fits_anywhere", lambda block: False)
    monkeypatch.setattr("photogram.network.core_arrays.available_memory", lambda: 1 << 29)
    with pytest.raises(OutOfMemoryError, match="ask for fewer"):
        small.covariances().covariance(("point", [point] * 3000))


def test_points_that_were_left_out_have_none():
    block = free_network(bars=False)
    seen = (block.image_points != 0) | (block.image_photos == block.image_photos[block.image_points == 0][0])
    fewer = block.replace(
        image_photos=block.image_photos[seen],
        image_points=block.image_points[seen],
        image_xy=block.image_xy[seen],
        image_sd=block.image_sd[seen],
    )
    result = adjust(fewer)
    with pytest.raises(InputError, check=lambda error: error.code == "free.left-out"):
        result.covariance(("point", "point1"))
    assert result.covariance(("point", None)).shape == (3 * 39, 3 * 39)


def test_the_example_knows_distances_and_areas(capsys):
    found = load("covariance_of_a_distance").main()
    printed = capsys.readouterr().out
    assert printed.count("+-") == len(found) == 4
    assert 0 < found["distance"].standard_deviation < 1.0
    assert abs(found["angle"].bias) < found["angle"].standard_deviation


@pytest.mark.parametrize("again", [copy.deepcopy, lambda result: pickle.loads(pickle.dumps(result))])
def test_results_that_are_copied_or_come_from_another_process_still_answer(small_block, again):
    free = adjust(small_block.replace(point_sd=np.inf))
    photo, point = small_block.photo_ids[1], small_block.point_ids[0]
    for result in (free, free.in_datum(InnerConstraints()), free.relative_to(photo=photo)):
        same = again(result)
        np.testing.assert_array_equal(same.point_cofactors, result.point_cofactors)
        selection = [("photo", photo), ("point", point)]
        np.testing.assert_array_equal(same.covariance(selection), result.covariance(selection))


def test_a_negative_variance_has_no_standard_deviation():
    assert np.isnan(standard_deviations(np.array([[[-1e-20]], [[4.0]]]))).tolist() == [[True], [False]]
