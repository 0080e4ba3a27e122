"""What the stars do not determine is named; what cannot be seen or weighted, too."""

from dataclasses import replace

import numpy as np
import pytest
import star_plates as plates

from message_codes import coded
from photogram import AdjustmentError, InputError
from photogram.stellar import INDEX, NAMES, calibrate

BOTH = pytest.mark.parametrize("as_published", [False, True])


@pytest.fixture
def made(truth):
    return plates.noisy(truth, np.random.default_rng(41))


def as_(published, problem):
    return replace(problem, options=replace(problem.options, as_published=published))


def only(truth, *free):
    return ~np.isin(NAMES, free)


@BOTH
def test_a_direction_of_no_decentering(made, as_published):
    start = plates.changed(made.initial, K4=0.0, K5=0.0)
    fixed = np.isin(NAMES, ["K4", "K5"])
    with pytest.raises(AdjustmentError, check=coded("stars.error-4", names=["phi_T"])):
        calibrate(as_(as_published, replace(made, initial=start, fixed=fixed)))


@BOTH
def test_the_centre_of_no_distortion(made, as_published):
    terms = ("K1", "K2", "K3", "K4", "K5")
    start = plates.changed(made.initial, **dict.fromkeys(terms, 0.0))
    with pytest.raises(AdjustmentError, check=coded("stars.error-4", names=["dx", "dy", "phi_T"])):
        calibrate(as_(as_published, replace(made, initial=start, fixed=np.isin(NAMES, terms))))


@BOTH
def test_radial_terms_of_stars_on_one_circle(truth, as_published):
    """Three coefficients and one radius: all three take part, nothing else does."""
    first = np.array([np.flatnonzero(truth.image_stars == star)[0] for star in range(75)])
    one = truth.without(np.zeros(75, bool), ~np.isin(np.arange(375), first))
    angles = 2 * np.pi * np.arange(75) / 75
    centre = one.initial[10:12] + one.initial[14:16]
    ring = centre + 0.06 * np.column_stack([np.cos(angles), np.sin(angles)])
    undistorted = plates.changed(one.initial, **dict.fromkeys(("epsilon", "K1", "K2", "K3", "K4", "K5"), 0.0))
    made = replace(one, image_xy=ring, initial=undistorted)
    places = made.core(undistorted, made.star_places, np.ones(26, bool)).directions()
    held = ~np.isin(NAMES, [*NAMES[:9], "K1", "K2", "K3"])
    with pytest.raises(AdjustmentError, check=coded("stars.error-4", names=["K1", "K2", "K3"])):
        calibrate(as_(as_published, replace(made, star_places=places, fixed=held)))


@BOTH
def test_a_weight_determines_what_the_stars_do_not(made, as_published):
    """Its correction is zero, its mean error that of the weight."""
    start = plates.changed(made.initial, K4=0.0, K5=0.0)
    weights = np.zeros((26, 26))
    weights[INDEX["phi_T"], INDEX["phi_T"]] = (plates.PLATE_SD / 0.1) ** 2
    problem = replace(made, initial=start, fixed=np.isin(NAMES, ["K4", "K5"]), parameter_weights=weights)
    result = calibrate(as_(as_published, problem))
    assert result.parameters["phi_T"] == pytest.approx(start[INDEX["phi_T"]], abs=1e-9)
    assert result.mean_errors["phi_T"] * plates.PLATE_SD / result.mean_error == pytest.approx(0.1, rel=1e-6)


@BOTH
def test_a_star_without_weight_of_its_own(made, as_published):
    """Error 2: plate coordinates of an unknown direction that weigh nothing."""
    stars, images = made.star_weights.copy(), made.image_weights.copy()
    stars[3] = 0
    images[made.image_stars == 3] *= 1e-170
    with pytest.raises(AdjustmentError, check=coded("stars.error-2", names=["4"])):
        calibrate(as_(as_published, replace(made, star_weights=stars, image_weights=images)))


@BOTH
def test_too_few_observations(made, as_published):
    """Error 3: two images for an attitude, a camera and two stars."""
    stars = np.isin(made.image_stars, [30, 40])
    chosen = np.flatnonzero(stars)[[0, 5]]
    few = made.without(np.zeros(75, bool), ~np.isin(np.arange(375), chosen))
    few = replace(few, image_groups=np.full(2, 2), star_weights=few.star_weights)
    with pytest.raises(AdjustmentError, check=coded("stars.error-3", observations=8, unknowns=20)):
        calibrate(as_(as_published, few))


@BOTH
def test_a_group_with_one_known_star(made, as_published):
    of_pre = np.unique(made.image_stars[made.image_groups == 0])
    weights = made.star_weights.copy()
    weights[of_pre[1:]] = 0
    with pytest.raises(AdjustmentError, check=coded("stars.few-known-stars", group="pre")):
        calibrate(as_(as_published, replace(made, star_weights=weights)))


@BOTH
def test_a_star_out_of_sight(made, as_published):
    start = made.initial + np.eye(26)[INDEX["alpha_pre"]] * np.pi
    with pytest.raises(AdjustmentError, check=coded("stars.not-visible")):
        calibrate(as_(as_published, replace(made, initial=start)))
    places = made.star_places.copy()
    places[4, 0] += np.pi
    with pytest.raises(AdjustmentError, check=coded("stars.not-visible", names=["5"])):
        calibrate(as_(as_published, replace(made, star_places=places)))


def test_a_weight_matrix_that_is_none(made):
    images, stars, parameters = made.image_weights.copy(), made.star_weights.copy(), np.zeros((26, 26))
    images[7] = [[1.0, 2.0], [2.0, 1.0]]
    with pytest.raises(InputError, check=coded("stars.point", point="103", star="2")):
        replace(made, image_weights=images)
    stars[5] = [[1.0, 1.0], [1.0, 1.0]]
    with pytest.raises(InputError, check=coded("stars.star", star="6")):
        replace(made, star_weights=stars)
    parameters[9:11, 9:11] = [[1.0, 2.0], [2.0, 1.0]]
    with pytest.raises(InputError, check=coded("stars.indefinite", names=["epsilon", "xp"])):
        calibrate(replace(made, parameter_weights=parameters))
