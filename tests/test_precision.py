"""Coordinates that double precision holds too coarsely, points behind cameras, unknowns hardly determined."""

from __future__ import annotations

import numpy as np
import pytest

from message_codes import raises
from photogram import AdjustmentError, adjust, simulate

BLOCK = simulate(strips=2, photos_per_strip=5, position_sd=30.0, attitude_sd=0.02).block


def with_position(value, **changes):
    positions = BLOCK.photo_positions.copy()
    positions[3, 0] = value
    return BLOCK.replace(photo_positions=positions, photo_positions_observed=positions, **changes)


def shifted(offset):
    return BLOCK.replace(
        photo_positions=BLOCK.photo_positions + offset,
        photo_positions_observed=BLOCK.photo_positions_observed + offset,
        point_positions=BLOCK.point_positions + offset,
    )


@pytest.mark.parametrize("value", [1e308, 1e101, 1e18, -1e18])
@pytest.mark.parametrize("sd", [30.0, np.inf, 0.0])
def test_a_position_too_large_for_double_precision_is_named(value, sd):
    sds = BLOCK.photo_position_sd.copy()
    sds[3] = sd
    with raises(AdjustmentError, "adjust.coarse"):
        adjust(with_position(value, photo_position_sd=sds))


def test_a_wrong_position_does_not_swamp_the_others():
    """What a photo far off contradicts shows in the sum of squares; rounding does not take it."""
    sds = BLOCK.photo_position_sd.copy()
    sds[3] = 0.0
    result = adjust(with_position(1e9, photo_position_sd=sds))
    # What the photo far off says is wrong by kilometres: the sum of squares shows it, whatever the status.
    assert result.sums_of_squares.total > 1e6


@pytest.mark.parametrize("offset", [1e7, 1e10])
def test_large_coordinates_give_the_same_digits(offset):
    moved = shifted(offset)
    expected, result = adjust(BLOCK), adjust(moved)
    rounding = np.spacing(offset)
    np.testing.assert_allclose(
        result.photo_positions - offset, expected.photo_positions, rtol=0, atol=4 * rounding + 1e-9
    )
    np.testing.assert_allclose(result.photo_sd, expected.photo_sd, rtol=1e-5)


def test_all_coordinates_too_large_are_named():
    with raises(AdjustmentError, "adjust.coarse"):
        adjust(shifted(1e17))


def test_a_standard_deviation_below_rounding_is_refused_and_zero_is_not():
    sds = BLOCK.photo_position_sd.copy()
    sds[0] = 1e-20
    with pytest.raises(AdjustmentError, match="photo 0101 must"):
        adjust(BLOCK.replace(photo_position_sd=sds))
    control = np.isfinite(BLOCK.point_sd)
    with pytest.raises(AdjustmentError, match="points C"):
        adjust(BLOCK.replace(point_sd=np.where(control, 1e-20, np.inf)))
    assert adjust(BLOCK.replace(point_sd=np.where(control, 0.0, np.inf))).status in ("converged", "diverged")


@pytest.mark.parametrize("sign", [-1, 1])
def test_points_behind_cameras_are_named(sign):
    """A photo that looks up sees its points at the places where they would be seen behind it."""
    block = BLOCK.replace(principal_distances=sign * np.abs(BLOCK.principal_distances))
    if sign > 0:
        block = block.replace(image_xy=-block.image_xy)
    seen = adjust(block)
    assert seen.converged
    assert not any("behind" in str(message) for message in seen.messages)
    attitudes = seen.photo_attitudes.copy()
    attitudes[2, 0] += np.pi
    upward = block.replace(
        photo_positions=seen.photo_positions,
        photo_positions_observed=seen.photo_positions,
        photo_attitudes=attitudes,
        photo_attitudes_observed=attitudes,
        photo_position_sd=np.array(0.0),
        photo_attitude_sd=np.array(0.0),
        point_positions=seen.point_positions,
        point_sd=np.array(0.0),
    )
    behind = next(str(m) for m in adjust(upward).messages if "behind the camera" in str(m))
    assert f"{(block.image_photos == 2).sum()} image points have their point behind" in behind
    assert "on photos 0103" in behind


@pytest.mark.parametrize("bend", [0.1, None])
def test_stations_on_a_line_end_with_the_unknowns_named(bend):
    block = simulate(
        strips=1, photos_per_strip=3, control="none", check_points=0, position_sd=0.1, position_error=0.1
    ).block
    if bend is not None:
        positions = block.photo_positions.copy()
        positions[:, 1:] = [[0, 4500], [bend, 4500], [0, 4500]]
        block = block.replace(photo_positions=positions, photo_positions_observed=positions)
    result = adjust(block, max_iterations=5000)
    assert result.converged
    assert len(result.iterations) < 30
    named = [str(message) for message in result.messages]
    assert any("omega of 0101, 0102, 0103" in text or "all 3 photos together" in text for text in named)
