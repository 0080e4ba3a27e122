"""Robust losses in the adjustment of a block."""

from __future__ import annotations

import json

import numpy as np
import pytest

from photogram import AsPublished, InputError, adjust, simulate


@pytest.fixture(scope="module")
def simulation():
    return simulate(
        strips=2,
        photos_per_strip=5,
        points_per_photo=40,
        control="corners",
        check_points=0,
        seed=4,
        blunders=8,
    )


def errors(result, simulation):
    return np.sqrt(np.nanmean((result.point_positions - simulation.truth.point_positions) ** 2))


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_gross_errors_hardly_move_a_robust_adjustment(simulation, loss):
    plain, robust = adjust(simulation.block), adjust(simulation.block, loss=loss)
    assert robust.converged
    assert errors(robust, simulation) < 0.5 * errors(plain, simulation)
    assert robust.variance_of_unit_weight < 0.3 * plain.variance_of_unit_weight
    assert any("modified weights" in message.text for message in robust.messages)
    used = robust.used_images
    assert ((robust.image_weights[used] > 0) & (robust.image_weights[used] <= 1)).all()
    assert (robust.image_weights[used] < 0.5).sum() < 30
    weighted = (robust.image_weights[:, None] * (robust.residuals / simulation.block.image_sd) ** 2)[
        used
    ].sum()
    assert robust.sums_of_squares.plates == pytest.approx(weighted, rel=1e-9)
    document = json.loads(robust.to_json())
    assert document["loss"] == {"name": loss, "scale": robust.loss[1]}
    factors = [observation["weight_factor"] for observation in document["observations"]]
    np.testing.assert_array_equal(factors, robust.image_weights[used])


def test_redundancy_numbers_still_sum_to_the_degrees_of_freedom(simulation):
    result = adjust(simulation.block, loss="huber")
    total = np.nansum(result.redundancy) + result.photo_redundancy.sum() + np.nansum(result.point_redundancy)
    assert total == pytest.approx(result.degrees_of_freedom, rel=1e-6)


def test_a_loss_that_never_sets_in_changes_nothing(simulation):
    plain, robust = adjust(simulation.block), adjust(simulation.block, loss=("huber", 1e6))
    np.testing.assert_allclose(plain.point_positions, robust.point_positions, rtol=1e-12)
    assert (robust.image_weights[robust.used_images] == 1).all()


def test_without_a_loss_all_weights_stand(simulation):
    result = adjust(simulation.block)
    assert result.loss is None
    assert (result.image_weights[result.used_images] == 1).all()


def test_options_that_cannot_be_are_refused(simulation):
    published = {"loss": "huber", "tolerance": AsPublished()}
    for options in ({"loss": "l1"}, {"loss": ("huber",)}, {"loss": ("huber", 0.0)}, published):
        with pytest.raises(InputError):
            adjust(simulation.block, **options)
