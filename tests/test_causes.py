"""Verdicts on wrong weights, disputed observations, common errors and robust losses."""

import numpy as np
import pytest

from photogram import Position, adjust, simulate, snoop
from photogram.statistics.findings import Removed


@pytest.fixture(scope="module")
def block():
    """Return a small block with control points and check points."""
    return simulate(
        strips=3,
        photos_per_strip=5,
        points_per_photo=40,
        flying_height=1000.0,
        control_sd=0.2,
        check_points=0,
        seed=11,
    ).block


def with_control(block, change):
    """Return the block with other coordinates of control."""
    positions = block.point_positions.copy()
    rows = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))
    change(positions, rows)
    return block.replace(point_positions=positions)


@pytest.mark.parametrize("factor", [10.0, 2.0, 0.5, 0.1])
def test_wrong_weights_of_images_do_not_scale_control(block, factor):
    found = adjust(block.replace(image_sd=block.image_sd * factor)).verdict
    assert (found.code, found.exit) == ("weights-of-types", 4)
    assert found.message.fields["types"][0].fields["factor"] == pytest.approx(1 / factor, rel=0.1)


def test_a_common_factor_of_all_types_remains(block):
    found = adjust(block.replace(image_sd=block.image_sd / 2, point_sd=block.point_sd / 2)).verdict
    assert (found.code, found.exit) == ("weights", 0)


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_a_loss_does_not_hide_wrong_control(block, loss):
    def raised(positions, rows):
        positions[rows[0], 2] += 45.0

    found = adjust(with_control(block, raised), loss=loss).verdict
    assert found.exit == 4


def test_a_loss_does_not_change_the_verdict_on_good_data(block):
    assert adjust(block, loss="huber").verdict.code == adjust(block).verdict.code


def test_one_of_three_control_points(block):
    rows = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))
    sd = block.point_sd.copy()
    sd[rows[3:]] = np.inf

    def moved(positions, rows):
        positions[rows[0], 0] += 20 * float(block.point_sd[rows[0], 0])

    found = snoop(with_control(block, moved).replace(point_sd=sd)).verdict
    assert (found.code, found.exit) == ("disputed", 4)
    assert (
        sum("control point" in str(each) for each in found.message.fields["groups"][0].fields["groups"]) == 3
    )


@pytest.mark.parametrize("common", [True, False])
def test_attitudes_are_not_removed_one_by_one(block, common):
    rng = np.random.default_rng(5)
    attitudes = adjust(block).photo_attitudes
    errors = np.array([0.02, 0.0, 0.0]) if common else rng.normal(size=attitudes.shape) * 0.02
    sd = np.full(attitudes.shape, 1e-3)
    found = snoop(block.replace(photo_attitudes_observed=attitudes + errors, photo_attitude_sd=sd))
    assert found.verdict.exit == 4
    assert (found.verdict.code == "common-error") is common
    assert not (common and found.removed)


def test_a_removed_share_of_every_type_is_limited():
    few, more = (Removed([{"name": "a"}], {"observations": (number, 12)}) for number in (1, 2))
    assert (few.excessive, more.excessive) == ([], ["observations"])


def named_causes(result):
    """Return the codes of the common errors in the headline."""
    return [each.fields["named"].code for each in result.verdict.message.fields["errors"]]


@pytest.mark.parametrize(
    ("change", "code", "size"),
    [
        (lambda own, centre: np.add(own, [0.0, 0.0, 5.0]), "control-heights", 5.0),
        (lambda own, centre: np.add(own, [4.0, -3.0, 0.0]), "control-shift", 4.0),
        (lambda own, centre: centre + 1.005 * (own - centre), "control-scale", 0.005),
    ],
)
def test_check_points_decide_how_all_control_is_wrong(change, code, size):
    """Without other observations of the datum, residuals show none of these errors."""
    block = simulate(strips=3, photos_per_strip=5, control_sd=0.2, check_points=5, seed=11).block

    def changed(positions, rows):
        positions[rows] = change(positions[rows], positions[rows].mean(axis=0))

    result = adjust(with_control(block, changed))
    every, (first, *_) = result._hypotheses(), named_causes(result)
    row = every.common()[0]
    assert (result.verdict.code, result.verdict.exit) == ("common-error", 4)
    assert first == f"hypothesis.{code}"
    assert row in every.relative
    found, sd = every.sets[row]["estimate"][0], np.sqrt(every.sets[row]["cofactors"][0])
    assert abs(found - size) < 4 * sd
    # The joint test of these differences is the same sum of squares, apart from the noise.
    together = result.check_points.agreement.together
    assert every.statistic[row] == pytest.approx(together.weighted_sum_of_squares, rel=0.2)


def test_too_small_standard_deviations_of_positions_are_named_before_single_positions():
    rng = np.random.default_rng(3)
    block = simulate(strips=3, photos_per_strip=8, control_sd=0.2, check_points=0, seed=12).block
    places = adjust(block).photo_positions
    observed = places + rng.normal(size=places.shape)
    gnss = [Position(name, own, 0.1) for name, own in zip(block.photo_ids, observed, strict=True)]
    found = adjust(block.replace(observations=[*block.observations, *gnss])).verdict
    assert (found.code, found.exit) == ("weights-of-types", 4)
    (wrong,) = found.message.fields["types"]
    # The first step of the estimation: wrong positions are also in the residuals of images.
    assert 4 < wrong.fields["factor"] < 10


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_check_points_decide_which_control_point_is_wrong(seed):
    simulated = simulate(strips=3, photos_per_strip=6, seed=seed)
    block, check_sd = simulated.block, 0.1
    # Without check points, the heights of four control points have one redundant number together.
    wrong = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))[0]
    positions, checks = block.point_positions.copy(), np.isfinite(block.point_check_sd).all(axis=1)
    errors = np.random.default_rng(seed).normal(scale=check_sd, size=(np.count_nonzero(checks), 3))
    positions[checks] = simulated.truth.point_positions[checks] + errors
    positions[wrong, 2] += 4.0
    given = np.full_like(positions, np.nan)
    given[checks] = check_sd
    result = adjust(block.replace(point_positions=positions, point_check_sd=given))
    assert result.verdict.exit == 4
    table = result.hypotheses()
    first = table.iloc[table["log_odds"].argmax()]
    assert first["hypothesis"] == f"Z of control point {block.point_ids[wrong]}"
    assert float(first["estimate"]) == pytest.approx(4.0, abs=1.5)
