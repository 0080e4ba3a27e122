"""The star-eliminated adjustment against a dense one, and the model against one of its own."""

from dataclasses import replace

import numpy as np
import pytest
import star_plates as plates

from photogram._photocore import pointing_matrix
from photogram.stellar import INDEX, NAMES, Axis, calibrate
from photogram.stellar.adjustment import free_parameters
from photogram.stellar.movement import modify


def as_it_is(truth, generator):
    return plates.noisy(truth, generator)


def distortion_first(truth, generator):
    options = replace(truth.options, distortion_first=0.3)
    return plates.noisy(plates.seen(replace(truth, options=options), truth.initial), generator)


def common_scale(truth, generator):
    options = replace(truth.options, common_scale=True)
    one = plates.changed(truth.initial, cy=truth.initial[INDEX["cx"]])
    return plates.noisy(plates.seen(replace(truth, options=options), one), generator)


def common_scale_and_distortion_first(truth, generator):
    options = replace(truth.options, common_scale=True, distortion_first=0.31)
    one = plates.changed(truth.initial, cy=truth.initial[INDEX["cx"]])
    return plates.noisy(plates.seen(replace(truth, options=options), one), generator)


def axis(truth, generator):
    return replace(plates.noisy(truth, generator), axis=pointed(truth, generator.normal(0, 5e-6, 2)))


def pointed(truth, error):
    """Return the direction of the axis at the event, whose image is the principal point."""
    d, e, f = plates.matrix(truth.initial[6:9])[2]
    azimuth, zenith = np.arctan2(-e, -d), np.arctan2(np.hypot(d, e), f)
    epsilon, xp, yp = truth.initial[9:12]
    return Axis(
        azimuth, zenith, np.array([xp - epsilon * yp, yp]) + error, np.array([[0.3, 0.1], [0.1, 0.4]])
    )


def correlated_weights(truth, generator):
    made = plates.noisy(truth, generator)
    turns = generator.uniform(-0.6, 0.6, len(made.image_points))
    cross = turns[:, None, None] * np.array([[0.0, 1.0], [1.0, 0.0]])
    stars = made.star_weights * np.array([[1.0, 0.5], [0.5, 2.0]])
    stars[:, 0, 1] = stars[:, 1, 0] = 0.4 * made.star_weights[:, 0, 0]
    return replace(made, image_weights=made.image_weights + cross, star_weights=stars)


def weighted_parameters(truth, generator):
    """Weights with correlations of what differs by ten orders of magnitude."""
    names = ("alpha_pre", "omega_event", "cx", "dx", "dy", "K3", "phi_T")
    sd = np.array([1e-4, 1e-4, 1e-5, 1e-3, 1e-3, 20.0, 0.05])
    chosen = np.array([INDEX[name] for name in names])
    correlation = np.full((7, 7), 0.3) + 0.7 * np.eye(7)
    weights = np.zeros((26, 26))
    weights[np.ix_(chosen, chosen)] = np.linalg.inv(correlation * np.outer(sd, sd)) * plates.PLATE_SD**2
    initial = truth.initial.copy()
    initial[chosen] += sd * generator.standard_normal(7)
    return replace(plates.noisy(truth, generator), parameter_weights=weights, initial=initial)


def unknown_directions(truth, generator):
    made = plates.noisy(truth, generator)
    weights = made.star_weights.copy()
    weights[::7] = 0
    return replace(made, star_weights=weights)


CASES = [
    as_it_is,
    distortion_first,
    common_scale,
    common_scale_and_distortion_first,
    axis,
    correlated_weights,
    weighted_parameters,
    unknown_directions,
]


@pytest.fixture(scope="module")
def few(truth):
    """Return every other star of the plate."""
    return truth.without(np.arange(75) % 2 == 1, np.zeros(375, bool))


def apart(cofactors):
    """Return mean errors and correlations of a matrix or several."""
    errors = np.sqrt(np.einsum("...ii->...i", cofactors))
    return errors, cofactors / (errors[..., :, None] * errors[..., None, :])


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_a_dense_adjustment_of_everything_agrees(few, case):
    problem = case(few, np.random.default_rng(21))
    result = calibrate(problem)
    assert result.converged
    free = free_parameters(problem)
    parameters, places, cofactors, squares = plates.dense(problem, few.initial, few.star_places, free)
    own = np.flatnonzero(free)
    errors, correlations = apart(cofactors[np.ix_(own, own)])
    off = (result.solved.parameters - parameters)[own]
    assert np.abs(off / errors).max() < 1e-10 * result.mean_error
    # Places in radians end at 2e-16.
    assert result.solved.places == pytest.approx(places, rel=0, abs=4e-16)
    given, correlated = apart(result.solved.cofactors[np.ix_(own, own)])
    assert given == pytest.approx(errors, rel=1e-10)
    assert correlated == pytest.approx(correlations, rel=0, abs=1e-10)
    stars = cofactors[len(NAMES) :, len(NAMES) :].reshape(len(places), 2, len(places), 2)
    errors, correlations = apart(np.einsum("sisj->sij", stars))
    given, correlated = apart(result.solved.star_cofactors)
    assert given == pytest.approx(errors, rel=1e-10)
    assert correlated == pytest.approx(correlations, rel=0, abs=1e-10)
    assert sum(result.solved.sums) == pytest.approx(squares, rel=1e-10)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_redundancy_and_standardized_residuals_are_those_of_the_dense_adjustment(few, case):
    """Of the decorrelated components: every share of the hat matrix, and their sum."""
    problem = case(few, np.random.default_rng(21))
    result, free = calibrate(problem), free_parameters(problem)
    design, right = plates.equations(problem, result.solved.parameters, result.solved.places, free)
    design = design[:, np.concatenate([np.flatnonzero(free), np.arange(len(NAMES), design.shape[1])])]
    hat = np.sum(np.linalg.qr(design / np.linalg.norm(design, axis=0))[0] ** 2, axis=1)
    images = 2 * len(problem.image_points)
    assert result.solved.redundancy.ravel() == pytest.approx(1 - hat[:images], abs=1e-9)
    tested = result.solved.star_redundancy[problem.known].ravel()
    assert tested == pytest.approx(1 - hat[images : images + len(tested)], abs=1e-9)
    # Residuals are computed minus observed.
    standardized = -right / np.sqrt(1 - hat)
    assert result.solved.standardized.ravel() == pytest.approx(standardized[:images], rel=1e-7, abs=1e-12)
    tested = result.solved.star_standardized[problem.known].ravel()
    assert tested == pytest.approx(standardized[images : images + len(tested)], rel=1e-7, abs=1e-12)
    assert len(hat) - hat.sum() == pytest.approx(result.degrees_of_freedom, abs=1e-9)


@pytest.mark.parametrize("case", [as_it_is, distortion_first, common_scale_and_distortion_first])
def test_the_camera_comes_back_from_images_of_a_model_of_its_own(truth, case):
    """Exact images, made step by step from the report's equations: a wrong sign or order anywhere shows."""
    noisy = case(truth, np.random.default_rng(21))
    exact = plates.seen(replace(noisy, star_places=truth.star_places), noisy.initial)
    start = exact.initial + np.concatenate([np.full(9, 0.01), np.zeros(17)])
    start[14:22] = 0
    result = calibrate(replace(exact, initial=start))
    errors = plates.PLATE_SD * np.sqrt(np.diag(result.solved.cofactors))
    off = (result.solved.parameters - exact.initial)[:22]
    chosen = errors[:22] > 0
    assert np.abs(off[chosen] / errors[:22][chosen]).max() < 1e-6


def test_published_tests_are_nearly_the_strict_ones(truth):
    """Its partials are right to a few parts in ten thousand."""
    strict = calibrate(plates.noisy(truth, np.random.default_rng(21)))
    options = replace(strict.problem.options, as_published=True)
    published = calibrate(replace(strict.problem, options=options))
    assert published.solved.redundancy == pytest.approx(strict.solved.redundancy, abs=2e-3)
    assert published.standardized == pytest.approx(strict.standardized, abs=0.03)
    assert published.solved.star_redundancy == pytest.approx(strict.solved.star_redundancy, abs=2e-3)
    assert published.star_standardized == pytest.approx(strict.star_standardized, abs=0.03)
    total = published.solved.redundancy.sum() + published.solved.star_redundancy.sum()
    assert total == pytest.approx(published.degrees_of_freedom, abs=0.5)


def test_the_method_of_modification_is_least_squares_with_constraints():
    """Equations 104 and 105 against the bordered normal equations."""
    generator = np.random.default_rng(24)
    rows = generator.standard_normal((30, 9))
    normal, right = rows.T @ rows, generator.standard_normal(9)
    c, misclosure = generator.standard_normal((3, 9)), generator.standard_normal(3)
    step, cofactors = modify(np.linalg.inv(normal), right, c, misclosure)
    bordered = np.linalg.inv(np.block([[normal, c.T], [c, np.zeros((3, 3))]]))
    assert step == pytest.approx((bordered @ np.concatenate([right, misclosure]))[:9], rel=1e-10)
    assert cofactors == pytest.approx(bordered[:9, :9], rel=1e-9, abs=1e-12)


def test_forms_of_the_model_differ_where_scales_differ(truth):
    """Scale after distortion moves an image by (cx / c0 - 1) of its distortion, here a hundredth."""
    wide = plates.changed(truth.initial, cx=0.303, cy=0.297)
    first = replace(truth, options=replace(truth.options, distortion_first=0.3))
    one, other = plates.seen(truth, wide).image_xy, plates.seen(first, wide).image_xy
    assert 1e-6 < np.abs(one - other).max() < 1e-4
    # Where both principal distances are the reference, they are one.
    equal = plates.changed(truth.initial, cx=0.3, cy=0.3)
    one, other = plates.seen(truth, equal).image_xy, plates.seen(first, equal).image_xy
    assert one == pytest.approx(other, abs=1e-16)


@pytest.mark.parametrize("as_published", [False, True])
def test_the_axis_counts_two_observations_and_holds_the_event(truth, as_published):
    """Equation 72, without distortion: a heavy axis keeps its image where it is."""
    made = plates.noisy(truth, np.random.default_rng(22))
    made = replace(made, options=replace(made.options, as_published=as_published))
    free = calibrate(made)
    given = pointed(truth, 0.0)
    with_axis = calibrate(replace(made, axis=replace(given, weight=np.eye(2) * 1e6)))
    assert with_axis.degrees_of_freedom == free.degrees_of_freedom + 2
    assert np.abs(with_axis.solved.axis_residual).max() < 1e-9
    found = plates.matrix(with_axis.solved.parameters[6:9])
    epsilon, xp, yp, cx, cy = with_axis.solved.parameters[9:14]
    m, n, q = found @ np.array([*given.standard, 1.0])
    x, y = xp + cx * m / q, yp + cy * n / q
    assert given.xy == pytest.approx([x - epsilon * y, y], abs=2e-9)
    assert with_axis.mean_errors["alpha_event"] < free.mean_errors["alpha_event"]


def test_the_matrix_turns_and_reflects():
    generator = np.random.default_rng(23)
    for angles in generator.uniform([-3, -1.5, -3], [3, 1.5, 3], (50, 3)):
        found = pointing_matrix(angles)
        assert found == pytest.approx(plates.matrix(angles), abs=1e-15)
        assert found @ found.T == pytest.approx(np.eye(3), abs=1e-15)
        assert np.linalg.det(found) == pytest.approx(-1.0)
