"""Properties of the calibration: algebra, noise, unknown directions, refraction, weights, movement."""

from dataclasses import replace

import numpy as np
import pytest
import star_plates as plates

from message_codes import coded
from photogram import AdjustmentError, InputError
from photogram.stellar import INDEX, calibrate
from photogram.stellar.iteration import DIVERGED, SETTLED, stop_reason


@pytest.mark.parametrize("as_published", [False, True])
def test_refraction_comes_back(truth, as_published):
    wrong = truth.initial.copy()
    wrong[INDEX["tau1"]] += 40.0
    measured = plates.seen(truth, wrong).image_xy
    weights = np.zeros((26, 26))
    weights[23:, 23:] = np.eye(3) * 1e6
    options = replace(truth.options, refraction=True, as_published=as_published, movement_factor=0.0)
    held = truth.fixed.copy()
    held[23:] = True
    held[:22] = np.isin(np.arange(22), range(9, 22))
    result = calibrate(replace(truth, image_xy=measured, options=options, fixed=held))
    assert result.parameters["tau1"] - truth.initial[INDEX["tau1"]] == pytest.approx(40.0, abs=0.5)


def test_a_huge_weight_freezes_a_parameter(plate):
    weights = np.zeros((26, 26))
    weights[INDEX["cx"], INDEX["cx"]] = 1e12
    frozen = calibrate(replace(plate, parameter_weights=weights))
    free = calibrate(plate)
    assert frozen.parameters["cx"] == pytest.approx(0.3, abs=1e-9)
    assert frozen.degrees_of_freedom == free.degrees_of_freedom + 1


def test_common_scale_counts_one_unknown_less(plate):
    result = calibrate(replace(plate, options=replace(plate.options, common_scale=True)))
    assert result.parameters["cx"] == result.parameters["cy"]
    assert result.counts.unknowns == 171


def test_what_the_stars_do_not_determine_is_named(plate):
    one = replace(plate, star_weights=np.zeros_like(plate.star_weights))
    with pytest.raises(AdjustmentError):
        calibrate(one)
    with pytest.raises(InputError, check=coded("stars.minimum-unknown")):
        calibrate(replace(plate, options=replace(plate.options, minimum_stars=("1", "999"))))


def test_the_minimum_solution_is_unique_and_a_pre_run_shows_the_rest(truth):
    start = truth.initial.copy()
    start[14:22] = 0
    one_group = truth.image_groups == 2
    stars = [truth.star_ids[i] for i in np.unique(truth.image_stars[one_group])[[0, 12]]]
    options = replace(truth.options, minimum_stars=tuple(stars), pre_run=True, as_published=True)
    result = calibrate(replace(truth, initial=start, options=options))
    assert result.counts.parameter_unknowns == 8
    assert result.pre_run is not None
    assert len(result.pre_run.points) == len(truth.image_points) - 10


def test_attitudes_that_do_not_differ_are_combined(truth):
    one = truth.initial.copy()
    one[0:3] = one[3:6] = one[6:9]
    tested = replace(truth, options=replace(truth.options, movement_factor=3.0))
    result = calibrate(plates.noisy(plates.seen(tested, one), np.random.default_rng(13)))
    assert result.combined is not None
    values = result.combined.solved.parameters
    assert values[0:3] == pytest.approx(values[6:9], abs=1e-12)
    assert result.combined.mean_error == pytest.approx(3e-6, rel=0.15)


def test_a_limit_counts_all_iterations(plate):
    result = calibrate(replace(plate, options=replace(plate.options, max_iterations=5)))
    assert result.solved.stop == "5 ITERATIONS COMPLETED"
    assert not result.converged
    assert len(result.levels) == 6


def test_stop_rules():
    assert stop_reason([1.0], 1e-3, 0) is None
    assert stop_reason([1.0, 1.0005], 1e-3, 0) == SETTLED
    assert stop_reason([1, 2, 1, 2, 1, 2, 1, 2], 1e-3, 0) == DIVERGED
    assert stop_reason([3.0, 2.0, 1.0], 1e-3, 2) == "2 ITERATIONS COMPLETED"
    assert stop_reason([1.0, np.inf], 1e-3, 0) == DIVERGED


def test_discrepancies_whose_squares_are_beyond_all_numbers_end_without_a_warning(plate):
    wrong = plate.initial.copy()
    wrong[INDEX["K1"]] = 1e160
    options = replace(plate.options, as_published=True)
    with pytest.raises(AdjustmentError, check=coded("stars.initial-camera")):
        calibrate(replace(plate, initial=wrong, options=options))
