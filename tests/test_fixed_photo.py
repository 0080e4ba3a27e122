"""A single photo whose position is fixed is held for the datum, with what it leaves open."""

import numpy as np
import pytest

from photogram import RankError, adjust, simulate


@pytest.fixture(scope="module")
def free():
    """Return a block of six photos without control, all of it free."""
    block = simulate(
        strips=2, photos_per_strip=3, points_per_photo=20, control="none", check_points=0, seed=8
    ).block
    return block.replace(photo_position_sd=np.inf, photo_attitude_sd=np.inf)


def fixed(block, photos, attitude=0.0):
    position_sd, attitude_sd = (np.full((6, 3), np.inf) for _ in range(2))
    position_sd[photos] = 0.0
    attitude_sd[photos] = attitude
    return block.replace(photo_position_sd=position_sd, photo_attitude_sd=attitude_sd)


def held(result):
    found = [str(each) for each in result.messages if each.code == "free.minimum"]
    return found[0] if found else ""


def test_a_photo_that_is_fixed_carries_the_datum(free):
    reference = adjust(free)
    result = adjust(fixed(free, [4]))
    assert result.converged
    assert result.variance_of_unit_weight == pytest.approx(reference.variance_of_unit_weight, rel=1e-9)
    np.testing.assert_allclose(result.redundancy, reference.redundancy, atol=1e-7)
    np.testing.assert_array_equal(result.photo_positions[4], free.photo_positions[4])
    np.testing.assert_array_equal(result.photo_attitudes[4], free.photo_attitudes[4])
    # Only the scale is left: one coordinate of another photo, that which differs most from the fixed one.
    differences = np.abs(free.photo_positions - free.photo_positions[4])
    photo, axis = np.unravel_index(differences.argmax(), differences.shape)
    assert f"{'XYZ'[axis]} of {free.photo_ids[photo]}" in held(result)
    assert (result.photo_sd == 0).sum() == 7


def test_attitude_and_scale_that_a_fixed_position_leaves_are_held_too(free):
    result = adjust(fixed(free, [4], attitude=np.inf))
    assert result.converged
    for angle in ("omega", "phi", "kappa"):
        assert f"{angle} of {free.photo_ids[4]}" in held(result)
    assert (result.photo_sd == 0).sum() == 7


def test_two_fixed_positions_are_the_datum_of_the_user(free):
    """What they leave open, the turn about their line, is not held for him."""
    with pytest.raises(RankError):
        adjust(fixed(free, [0, 5], attitude=np.inf))
    assert held(adjust(fixed(free, [0, 5]))) == ""
