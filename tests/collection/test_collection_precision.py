"""Values of collections that double precision holds too coarsely."""

from __future__ import annotations

import numpy as np
import pytest

from message_codes import raises
from photogram import AdjustmentError
from photogram.collection import adjust, simulate

COLLECTION = simulate(photos=6, points=40, coarseness=0.2, seed=1).collection


def with_photo(parameter, value, sd=np.inf):
    parameters = COLLECTION.photo_parameters.copy()
    parameters[2, parameter] = value
    sds = np.full(parameters.shape, np.inf)
    sds[2, parameter] = sd
    return COLLECTION.replace(photo_parameters=parameters, photo_sd=sds)


def with_point(value, sd=np.inf):
    positions = COLLECTION.point_positions.copy()
    positions[7, 1] = value
    sds = np.full(positions.shape, np.inf)
    sds[7, 1] = sd
    return COLLECTION.replace(point_positions=positions, point_sd=sds)


@pytest.mark.parametrize("value", [1e308, -1e101, 1e16])
@pytest.mark.parametrize("sd", [np.inf, 1.0, 0.0])
@pytest.mark.parametrize("parameter", [0, 4])
def test_a_photo_too_large_for_double_precision_is_named(parameter, value, sd):
    with raises(AdjustmentError, "adjust.coarse"):
        adjust(with_photo(parameter, value, sd))


@pytest.mark.parametrize("value", [1e308, -1e101, 1e16])
@pytest.mark.parametrize("sd", [np.inf, 1.0, 0.0])
def test_a_point_too_large_for_double_precision_is_named(value, sd):
    with raises(AdjustmentError, "adjust.coarse"):
        adjust(with_point(value, sd))


def test_a_focal_length_that_no_number_can_be_squared_of_is_named():
    with raises(AdjustmentError, "adjust.coarse"):
        adjust(with_photo(6, 1e200))


def test_a_standard_deviation_below_rounding_is_refused():
    with raises(AdjustmentError, "adjust.coarse"):
        adjust(with_point(COLLECTION.point_positions[7, 1], 1e-20))


def test_all_values_large_against_what_images_show_are_named():
    """Shifted by 1e17: the translations of the photos and all points."""
    parameters = COLLECTION.photo_parameters.copy()
    parameters[:, :3] = 0.0
    parameters[:, 3] -= 1e17
    shifted = COLLECTION.replace(
        photo_parameters=parameters, point_positions=COLLECTION.point_positions + np.array([1e17, 0.0, 0.0])
    )
    with raises(AdjustmentError, "adjust.coarse"):
        adjust(shifted)


def test_what_takes_no_part_is_not_checked():
    """A point on no photo, wherever it may be."""
    collection = COLLECTION.replace(
        point_positions=np.vstack([COLLECTION.point_positions, [[1e300, 0.0, 0.0]]]),
        point_sd=np.array(np.inf),
    )
    assert adjust(collection).converged
