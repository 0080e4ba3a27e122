"""Every row of the specification's feature table (its section 11) has a test that shows it."""

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
CORE = TESTS.parents[1] / "crates" / "photogram-programs" / "tests"

FEATURES = {
    "hour-angle and standard coordinates both ways": [
        "star_refraction::test_standard_coordinates_come_back",
    ],
    "refraction, observed and true": [
        "golden::test_refraction",
        "star_refraction::test_refraction_is_that_of_rays_at_standard_conditions",
        "star_refraction::test_refraction_agrees_with_erfa_to_75_degrees",
    ],
    "refraction in hour angle and declination": [
        "star_refraction::test_refraction_in_hour_angle_and_declination_keeps_the_azimuth",
    ],
    "diurnal aberration": [
        "star_refraction::test_diurnal_aberration_moves_a_star_of_the_meridian_east",
    ],
    "projective matrix with reflection": [
        "golden::test_forward",
        "dense::test_the_matrix_turns_and_reflects",
    ],
    "radial and decentering distortion about their own centre": [
        "stellar.rs::distortion_is_inverted",
        "dense::test_the_camera_comes_back_from_images_of_a_model_of_its_own",
    ],
    "two principal distances, nonperpendicularity": [
        "stellar.rs::a_direction_comes_back",
        "adjustment::test_common_scale_counts_one_unknown_less",
    ],
    "distortion iteration and its warning": [
        "solutions::test_distortion_that_does_not_settle_is_told_and_computation_goes_on",
    ],
    "partials": [
        "stellar.rs::partials_are_exact",
        "golden::test_forward",
    ],
    "orientations pre, post and event": [
        "solutions::test_groups_with_a_camera_that_is_held_are_solutions_of_their_own",
    ],
    "star elimination": [
        "dense::test_a_dense_adjustment_of_everything_agrees",
    ],
    "parameter weights": [
        "adjustment::test_a_huge_weight_freezes_a_parameter",
        "undetermined::test_a_weight_determines_what_the_stars_do_not",
    ],
    "azimuth and elevation of the axis": [
        "dense::test_the_axis_counts_two_observations_and_holds_the_event",
    ],
    "unknown directions and ellipses": [
        "noise::test_unknown_directions_lie_in_their_ellipses",
    ],
    "three stop rules": [
        "adjustment::test_stop_rules",
        "adjustment::test_a_limit_counts_all_iterations",
    ],
    "minimum solution and pre-run": [
        "solutions::test_a_solution_that_is_just_possible_has_one_degree_of_freedom",
        "solutions::test_a_pre_run_shows_a_blunder",
    ],
    "refraction coefficients": [
        "solutions::test_refraction_comes_back_with_the_camera_free",
    ],
    "residual cycle, statistics, mean errors": [
        "golden::test_adjustment_with_noise",
        "solutions::test_means_of_a_star_are_radial_and_tangential",
    ],
    "movement test and combination": [
        "golden::test_combination",
        "noise::test_false_alarms_of_the_movement_test",
        "noise::test_a_movement_is_found",
    ],
    "pole and reference station": [
        "golden::test_transformation",
    ],
    "distortion curves": [
        "golden::test_curves",
        "solutions::test_the_transformed_distortion_vanishes_at_the_crossover",
    ],
    "refraction curves": [
        "solutions::test_refraction_curves_are_those_of_the_coefficients",
    ],
    "histograms": [
        "solutions::test_classes_of_a_histogram",
    ],
    "cards, options, rejections, errors": [
        "deck::test_deck_and_plain_form_agree",
        "deck_errors::test_a_bad_card",
    ],
    "given mean error": [
        "solutions::test_a_given_mean_error_scales_covariances_only",
    ],
}


@pytest.mark.parametrize("feature", FEATURES)
def test_a_feature_has_tests(feature):
    for name in FEATURES[feature]:
        file, test = name.split("::")
        path = CORE / file if file.endswith(".rs") else TESTS / f"test_{file}.py"
        assert re.search(rf"^\s*(def|fn) {test}\(", path.read_text(), re.MULTILINE), name
