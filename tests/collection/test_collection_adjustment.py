"""Collections with known truth: far starts, covariances, outliers, what is undetermined."""

from __future__ import annotations

import numpy as np
import pytest

from message_codes import raises
from photogram import AdjustmentError, InputError
from photogram.collection import PARAMETERS, Collection, adjust, simulate, simulate_turntable


def computed(collection: Collection, unknowns: np.ndarray) -> np.ndarray:
    """Return weighted image coordinates at other values of all unknowns: photos, then points."""
    photos = unknowns[: collection.photo_parameters.size].reshape(-1, 9)
    points = unknowns[collection.photo_parameters.size :].reshape(-1, 3)
    moved = collection.replace(photo_parameters=photos, point_positions=points)
    return (moved.computed_xy() / collection.image_sd).ravel()


def jacobian(collection: Collection) -> np.ndarray:
    """Return the partials of all image coordinates by central differences."""
    start = np.concatenate([collection.photo_parameters.ravel(), collection.point_positions.ravel()])
    columns = []
    for k, value in enumerate(start):
        step = np.zeros_like(start)
        step[k] = 1e-5 * max(abs(value), 0.1)
        columns.append(
            (computed(collection, start + step) - computed(collection, start - step)) / (2 * step[k])
        )
    return np.stack(columns, axis=1)


def test_trafalgar_ends_where_ceres_does(trafalgar):
    assert trafalgar.cost() == pytest.approx(4.413239e6, rel=1e-6)
    result = adjust(trafalgar)
    assert result.converged
    assert result.cost <= 3.037864e4
    assert 0.5 * result.weighted_sum_of_squares == pytest.approx(result.cost, rel=1e-12)
    assert result.adjusted().cost() == pytest.approx(result.cost, rel=1e-12)
    assert result.degrees_of_freedom == 2 * 36455 - 9 * 21 - 3 * 11315 + 7
    assert np.nansum(result.redundancy) == pytest.approx(result.degrees_of_freedom, rel=1e-6)
    assert (result.predictions[result.ordering] <= np.array(list(result.predictions.values()))).all()


@pytest.mark.parametrize("seed", range(5))
def test_far_starts_lead_to_the_minimum_near_the_truth(seed):
    made = simulate(photos=12, points=100, coarseness=3, seed=seed)
    far, near = adjust(made.collection, covariance=False), adjust(made.truth)
    assert made.collection.cost() > 1e4 * near.cost
    assert far.converged
    assert far.cost == pytest.approx(near.cost, rel=1e-7)
    assert near.variance_of_unit_weight == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("seed", range(2))
def test_a_weak_collection_takes_few_steps_along_its_valley(seed):
    made = simulate_turntable(photos=60, points=800, rays=10, distance=60, seed=seed)
    far, near = adjust(made.collection), adjust(made.truth)
    assert far.converged
    assert len(far.iterations) <= 30
    assert far.cost == pytest.approx(near.cost, rel=1e-7)
    assert far.variance_of_unit_weight == pytest.approx(1, abs=0.1)
    relative = np.sqrt(far.photo_cofactors[:, 6, 6]) / np.abs(far.photo_parameters[:, 6])
    assert np.median(relative) > 0.1


def test_a_turntable_that_cannot_be_is_refused():
    with pytest.raises(InputError, check=lambda error: error.code == "collection.few-photos"):
        simulate_turntable(photos=5, rays=6)
    with pytest.raises(InputError, check=lambda error: error.code == "collection.distance"):
        simulate_turntable(distance=2)


def test_flawless_images_give_the_truth_up_to_a_similarity():
    made = simulate(noise=0, seed=9)
    result = adjust(made.collection)
    assert result.converged
    assert result.cost < 1e-12
    np.testing.assert_allclose(result.photo_parameters[:, 6:], made.truth.photo_parameters[:, 6:], rtol=1e-6)


def test_cofactors_are_those_of_the_dense_normal_equations_in_the_same_datum():
    made = simulate(photos=5, points=15, seed=4)
    result = adjust(made.truth, tolerance=1e-12)
    rows = jacobian(result.adjusted())
    held = [9 * photo + PARAMETERS.index(name) for photo, name in result.datum]
    assert len(held) == 7
    free = np.setdiff1d(np.arange(rows.shape[1]), held)
    dense = np.zeros((rows.shape[1],) * 2)
    dense[np.ix_(free, free)] = np.linalg.inv(rows[:, free].T @ rows[:, free])
    for photo, cofactors in enumerate(result.photo_cofactors):
        own = slice(9 * photo, 9 * photo + 9)
        scale = np.sqrt(np.outer(*(2 * [np.diag(dense[own, own])]))) + 1e-300
        np.testing.assert_allclose(cofactors / scale, dense[own, own] / scale, atol=1e-5)
    for point, cofactors in enumerate(result.point_cofactors):
        own = slice(45 + 3 * point, 48 + 3 * point)
        np.testing.assert_allclose(
            cofactors, dense[own, own], rtol=1e-4, atol=1e-6 * np.trace(dense[own, own])
        )
    shares = np.einsum("ij,jk,ik->i", rows, dense, rows)
    np.testing.assert_allclose(result.redundancy.ravel(), 1 - shares, atol=1e-6)


def test_estimates_scatter_as_their_covariances_say():
    """Focal lengths and the distance between two points do not depend on the datum."""
    truth = simulate(photos=6, points=40, coarseness=0, noise=0.5, seed=8).truth
    exact = truth.computed_xy()
    random = np.random.default_rng(8)
    scores = []
    for _ in range(60):
        result = adjust(truth.replace(image_xy=exact + random.normal(0, 0.5, exact.shape)))
        error = result.photo_parameters[:, 6] - truth.photo_parameters[:, 6]
        scores.append(error / np.sqrt(result.photo_cofactors[:, 6, 6]))
    # 360 scores, correlated within a sample: their mean square has a standard deviation of 0.1 or so.
    assert np.mean(np.square(scores)) == pytest.approx(1, abs=0.3)


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_robust_losses_recover_the_truth_among_outliers(loss):
    made = simulate(photos=12, points=100, outlier_share=0.1, seed=2)
    good = ~made.outliers
    clean = adjust(
        made.truth.replace(
            image_photos=made.truth.image_photos[good],
            image_points=made.truth.image_points[good],
            image_xy=made.truth.image_xy[good],
            image_sd=np.array(0.5),
        )
    )
    focal = made.truth.photo_parameters[:, 6]

    def error(result):
        return np.sqrt(np.mean((result.photo_parameters[:, 6] - focal) ** 2))

    robust, squares = adjust(made.collection, loss=loss), adjust(made.collection)
    assert robust.converged
    assert error(robust) < 1.5 * error(clean) < 0.1 * error(squares)
    assert np.median(robust.image_weights[made.outliers]) < 0.02
    assert np.median(robust.image_weights[good]) > 0.8
    assert (np.abs(robust.standardized[made.outliers]).max(axis=1) > 4).mean() > 0.9
    assert any("modified weights" in message.text for message in robust.messages)


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_a_robust_adjustment_ends_where_the_gradient_of_the_loss_vanishes(loss):
    made = simulate(photos=6, points=30, outlier_share=0.1, seed=5)
    result = adjust(made.collection, loss=(loss, 2.0), tolerance=1e-14, max_iterations=500)
    residuals = (result.residuals / made.collection.image_sd).ravel()
    weights = np.repeat(result.image_weights, 2)
    rows = jacobian(result.adjusted())
    gradient = rows.T @ (weights * residuals)
    size = np.abs(rows.T) @ (weights * np.abs(residuals))
    assert (np.abs(gradient) < 1e-4 * size).all()
    squares = (residuals**2).reshape(-1, 2).sum(axis=1)
    inside = squares <= 4
    losses = (
        np.where(inside, squares, 4 * np.sqrt(squares) - 4) if loss == "huber" else 4 * np.log1p(squares / 4)
    )
    assert result.cost == pytest.approx(0.5 * losses.sum(), rel=1e-12)
    assert result.weighted_sum_of_squares == pytest.approx((result.image_weights * squares).sum(), rel=1e-12)


def test_a_loss_that_never_sets_in_changes_nothing():
    made = simulate(seed=3)
    plain, robust = adjust(made.collection), adjust(made.collection, loss=("huber", 1e6), tolerance=1e-8)
    np.testing.assert_array_equal(plain.photo_parameters, robust.photo_parameters)
    assert (robust.image_weights == 1).all()


def test_weighted_points_give_the_datum_and_covariances_that_hold_in_it():
    scores = []
    for seed in range(12):
        made = simulate(coarseness=0, seed=seed)
        sd = np.full((60, 3), np.inf)
        sd[:6] = 0.01
        positions = made.truth.point_positions.copy()
        positions[:6] += np.random.default_rng(seed).normal(0, 0.01, (6, 3))
        result = adjust(made.collection.replace(point_positions=positions, point_sd=sd))
        assert result.converged
        assert result.datum == []
        redundancy = np.nansum(result.redundancy) + result.point_redundancy.sum()
        assert redundancy == pytest.approx(result.degrees_of_freedom, rel=1e-8)
        error = result.point_positions - made.truth.point_positions
        scores.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(result.point_cofactors), error).mean())
    # Chi squares of three; those of a sample share the errors of the datum, and scatter together.
    assert np.mean(scores) == pytest.approx(3, abs=1)


def test_what_is_on_one_photo_or_none_is_left_out_and_named():
    made = simulate(photos=4, points=20, seed=7).collection
    lonely = np.append(made.point_positions, [[0, 0, 0], [1, 1, 1]], axis=0)
    photos = np.append(made.photo_parameters, made.photo_parameters[:1], axis=0)
    collection = Collection(
        photo_parameters=photos,
        point_positions=lonely,
        image_photos=np.append(made.image_photos, 4),
        image_points=np.append(made.image_points, 20),
        image_xy=np.append(made.image_xy, [[1.0, 2.0]], axis=0),
    )
    result = adjust(collection)
    assert result.converged
    names = {message.code: message.phrase.fields.get("names") for message in result.messages}
    assert names["collection.photos-undetermined"] == ["4"]
    assert names["collection.points-with-one-ray"] == ["20", "21"]
    np.testing.assert_array_equal(result.photo_parameters[4], photos[4])
    assert np.isnan(result.point_positions[20:]).all()
    assert np.isnan(result.residuals[-1]).all()
    np.testing.assert_array_equal(result.adjusted().point_positions[20:], lonely[20:])
    assert np.isnan(result.photo_cofactors[4]).all()
    assert np.isfinite(result.photo_cofactors[:4]).all()


def test_two_collections_in_one_have_a_datum_each():
    one, two = simulate(photos=4, points=20, seed=1).truth, simulate(photos=4, points=20, seed=2).truth
    both = Collection(
        photo_parameters=np.concatenate([one.photo_parameters, two.photo_parameters]),
        point_positions=np.concatenate([one.point_positions, two.point_positions]),
        image_photos=np.concatenate([one.image_photos, two.image_photos + 4]),
        image_points=np.concatenate([one.image_points, two.image_points + 20]),
        image_xy=np.concatenate([one.image_xy, two.image_xy]),
    )
    result = adjust(both)
    assert result.converged
    assert np.isfinite(result.photo_cofactors).all()
    assert result.messages[0].code == "collection.datum"
    # Seven unknowns of each, pose and scale.
    assert sorted(photo // 4 for photo, _ in result.datum) == [0] * 7 + [1] * 7


def test_nothing_to_adjust_is_an_error():
    made = simulate(photos=2, points=1, seed=1).collection
    alone = made.replace(image_photos=np.zeros(2, int))
    with pytest.raises(AdjustmentError, match="no point is left to adjust"):
        adjust(alone)


def test_a_start_in_the_plane_of_the_projection_centre_is_an_error():
    made = simulate(photos=2, points=5, seed=1).truth
    parameters = made.photo_parameters.copy()
    parameters[0, 3:6] = parameters[0, :3] = 0
    positions = made.point_positions.copy()
    positions[0, 2] = 0
    with pytest.raises(AdjustmentError, match="must give finite coordinates"):
        adjust(made.replace(photo_parameters=parameters, point_positions=positions))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"ordering": "none"}, "ordering: must be one of"),
        ({"max_iterations": 0}, "error.least"),
        ({"tolerance": 0.0}, "error.positive"),
        ({"tolerance": float("nan")}, "error.positive"),
        ({"threads": 0}, "error.least"),
        ({"loss": "tukey"}, "loss: must be one of huber, cauchy"),
        ({"loss": ("huber", -1.0)}, "error.positive"),
        ({"loss": ("huber", float("inf"))}, "error.positive"),
    ],
)
def test_options_that_cannot_be_are_refused(options, message):
    with raises(InputError, message):
        adjust(simulate().collection, **options)


def test_progress_is_told_and_can_stop():
    phases = []
    result = adjust(simulate(coarseness=2).collection, progress=phases.append)
    assert [each.iteration for each in phases if each.iteration] == result.iterations

    def stop(progress):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        adjust(simulate(coarseness=2).collection, progress=stop)
