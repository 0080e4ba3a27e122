"""Solutions beside the ordinary one: groups apart, refraction, minimum, given mean errors, curves."""

import math
from dataclasses import replace

import numpy as np
import pytest
import star_plates as plates

from message_codes import fields_of, has_code
from photogram.stellar import ARCSEC, INDEX, NAMES, calibrate, refraction
from photogram.stellar.curves import (
    distortion_curves,
    histogram,
    mean_error_ellipses,
    refraction_curves,
    residual_classes,
)
from photogram.stellar.parameters import GROUPS
from photogram.stellar.tables import star_means


@pytest.fixture(scope="module")
def low(truth):
    """Return the plate with its cameras turned down: stars from 39 to 79 degrees from the zenith."""
    turned = plates.changed(
        truth.initial,
        alpha_pre=1.0,
        alpha_post=1.05,
        alpha_event=0.95,
        omega_pre=0.1,
        omega_post=-0.1,
        omega_event=0.0,
    )
    directions = truth.core(turned, truth.star_places, np.ones(26, bool)).directions()
    third = np.array([np.flatnonzero(truth.image_stars == star)[2] for star in range(75)])
    return plates.seen(replace(truth, star_places=directions[third]), turned)


def hazy(low, seconds):
    """Return the plate in air that refracts more than the given tau1 says; the others are weighted."""
    weights = np.zeros((26, 26))
    weights[23:, 23:] = np.eye(3) * (plates.PLATE_SD / 4.0) ** 2
    true = plates.changed(low.initial, tau1=low.initial[INDEX["tau1"]] + seconds)
    return replace(
        plates.seen(low, true),
        initial=low.initial,
        parameter_weights=weights,
        options=replace(low.options, refraction=True),
    )


def test_groups_with_a_camera_that_is_held_are_solutions_of_their_own(truth):
    made = plates.noisy(truth, np.random.default_rng(51))
    held = np.isin(NAMES, NAMES[9:])
    together = calibrate(replace(made, fixed=held))
    for group, name in enumerate(GROUPS):
        others = made.image_groups != group
        alone = calibrate(replace(made.without(np.zeros(75, bool), others), fixed=held))
        own = [INDEX[f"{angle}_{name}"] for angle in ("alpha", "omega", "kappa")]
        cofactors = alone.solved.cofactors[np.ix_(own, own)]
        errors = np.sqrt(np.diag(cofactors))
        off = together.solved.parameters[own] - alone.solved.parameters[own]
        assert np.abs(off / errors).max() < 1e-9 * together.mean_error
        given = together.solved.cofactors[np.ix_(own, own)] / np.outer(errors, errors)
        assert given == pytest.approx(cofactors / np.outer(errors, errors), abs=1e-9)
        assert alone.estimated == [f"{angle}_{name}" for angle in ("alpha", "omega", "kappa")]


def test_refraction_comes_back_with_the_camera_free(low):
    """Forty seconds of tau1, known to 4.5; the report's single correction ends half a mean error away."""
    problem, runs = hazy(low, 40.0), 30
    true = low.initial[INDEX["tau1"]] + 40.0
    strict, published = [], []
    for seed in range(runs):
        made = plates.noisy(problem, np.random.default_rng(seed))
        result = calibrate(made)
        assert result.converged
        once = calibrate(replace(made, options=replace(made.options, as_published=True)))
        assert [len(stage.levels) for stage in once.stages if stage.solution == "refraction"] == [2]
        for found, list_ in ((result, strict), (once, published)):
            list_.append((found.parameters["tau1"] - true) / found.mean_errors["tau1"])
    assert 4.0 < result.mean_errors["tau1"] < 5.0
    assert abs(np.mean(strict)) < 3.5 / np.sqrt(runs)
    assert np.std(strict) == pytest.approx(1.0, abs=3.5 / np.sqrt(2 * runs))
    assert np.abs(np.subtract(strict, published)).max() < 0.6


def test_weighted_coefficients_count_as_observations(low):
    made = plates.noisy(hazy(low, 0.0), np.random.default_rng(52))
    without = calibrate(replace(made, options=replace(made.options, refraction=False)))
    found = calibrate(made)
    assert found.counts.parameter_observations == without.counts.parameter_observations + 3
    assert found.degrees_of_freedom == without.degrees_of_freedom - 1


def test_refraction_curves_are_those_of_the_coefficients(low):
    result = calibrate(plates.noisy(hazy(low, 40.0), np.random.default_rng(53)))
    curves = refraction_curves(result, "event")
    axis = np.arccos(plates.matrix(result.solved.parameters[6:9])[2, 2])
    assert curves.zenith_distance == pytest.approx(axis + np.radians(np.arange(-10, 11)), abs=1e-12)
    air = result.problem.site.air
    assert curves.given == pytest.approx(refraction(curves.zenith_distance, air, observed=True), rel=1e-12)
    tau = result.solved.parameters[22:]
    assert curves.corrected == pytest.approx(
        refraction(curves.zenith_distance, air, tau=tau, observed=True), rel=1e-12
    )
    # Differences of the coefficients, one mean error each, in the directions of their covariance.
    values, vectors = np.linalg.eigh(result.covariance[22:, 22:])
    moved = [tau + np.sqrt(value) * vector for value, vector in zip(values, vectors.T, strict=True)]
    steps = [refraction(curves.zenith_distance, air, tau=each, observed=True) for each in moved]
    assert curves.error == pytest.approx(np.linalg.norm(steps - curves.corrected, axis=0), rel=1e-6)


def test_a_solution_that_is_just_possible_has_one_degree_of_freedom(truth):
    """Two known stars with two images for eight parameters and four places."""
    stars = np.unique(truth.image_stars[truth.image_groups == 2])[[0, 24]]
    images = np.concatenate([np.flatnonzero(truth.image_stars == star)[[0, 4]] for star in stars])
    few = truth.without(np.zeros(75, bool), ~np.isin(np.arange(375), images))
    start = plates.changed(few.initial, **dict.fromkeys(NAMES[14:21], 0.0))
    held = np.isin(NAMES, NAMES[14:22])
    options = replace(few.options, minimum_stars=tuple(few.star_ids), pre_run=True)
    for as_published in (False, True):
        result = calibrate(
            replace(few, initial=start, fixed=held, options=replace(options, as_published=as_published))
        )
        assert result.degrees_of_freedom == 0
        assert result.counts.usable == 1
        assert np.abs(result.solved.residuals).max() < 1e-9


def test_a_pre_run_shows_a_blunder(truth):
    """Residuals of the images that took no part are what a camera without distortion leaves, but for one."""
    plain = plates.changed(truth.initial, **dict.fromkeys(NAMES[14:21], 0.0))
    made = plates.noisy(plates.seen(truth, plain), np.random.default_rng(54), 1e-7, 0.005 * ARCSEC)
    one = replace(made, image_groups=np.full(375, 2))
    exact = plates.noisy(plates.seen(one, plain), np.random.default_rng(54), 1e-7, 0.005 * ARCSEC)
    xy = exact.image_xy.copy()
    xy[200] += [1e-4, 0.0]
    stars = tuple(exact.star_ids[i] for i in (0, 20, 30, 60))
    options = replace(exact.options, minimum_stars=stars, pre_run=True)
    result = calibrate(replace(exact, image_xy=xy, options=options))
    assert len(result.pre_run.points) == 375 - 20
    sizes = np.abs(result.pre_run.residuals).max(axis=1)
    assert result.pre_run.stars[int(sizes.argmax())] == exact.star_ids[exact.image_stars[200]]
    assert (sizes > 5e-5).sum() == 1


def test_a_given_mean_error_scales_covariances_only(plate):
    free = calibrate(plates.quiet(plate))
    given = calibrate(replace(plate, options=replace(free.problem.options, mean_error=6e-6)))
    assert (given.solved.parameters == free.solved.parameters).all()
    assert given.computed_mean_error == free.mean_error
    ratio = (6e-6 / free.mean_error) ** 2
    assert given.covariance == pytest.approx(ratio * free.covariance, rel=1e-12)
    assert given.standardized == pytest.approx(free.standardized / np.sqrt(ratio), rel=1e-12)


def test_classes_of_a_histogram(truth):
    result = calibrate(plates.noisy(truth, np.random.default_rng(55)))
    for values in residual_classes(result).values():
        found = histogram(values)
        classes, number = len(found.counts), len(values)

        def last(n, number=number):
            return 6.5 * number * math.exp(-0.5 * (3.25 * (1 - 1 / n)) ** 2) / (n * math.sqrt(2 * math.pi))

        # The most, of 31, 29 and so on, whose last class is expected to hold one residual.
        assert last(classes) > 1
        assert classes == 31 or last(classes + 2) <= 1
        assert classes % 2 == 1
        sd = np.sqrt(np.mean(values**2) - values.mean() ** 2)
        assert found.edges[[0, -1]] == pytest.approx([values.mean() - 3.25 * sd, values.mean() + 3.25 * sd])
        assert found.counts.sum() >= 0.995 * number
        assert found.expected.sum() == pytest.approx(number, rel=0.01)


def test_distortion_that_does_not_settle_is_told_and_computation_goes_on(truth):
    """Six passes are too few for a distortion of five millimetres."""
    wild = plates.changed(truth.initial, K1=-5.0)
    options = replace(truth.options, as_published=True, distortion_tolerance=1e-9)
    result = calibrate(replace(plates.seen(truth, wild), options=options))
    assert fields_of(result.messages, "stars.unsettled-distortion")["point"] == "101"
    assert result.parameters["K1"] == pytest.approx(-5.0, abs=0.05)


def test_results_name_what_is_doubtful(plate):
    """Correlations above 0.95, terms within 1.96 mean errors of zero."""
    result = calibrate(plate)
    sd = np.sqrt(np.diag(result.covariance)[:22])
    correlation = result.covariance[:22, :22] / np.outer(sd, sd)
    rows, columns = np.nonzero(np.triu(np.abs(correlation) > 0.95, 1))
    expected = {(NAMES[i], NAMES[j]) for i, j in zip(rows, columns, strict=True)}
    assert {(a, b) for a, b, _ in result.correlated()} == expected
    assert ("K4", "K5") in expected
    (pair,) = (m for m in result.messages if has_code(m, "stars.correlation", first="K4", second="K5"))
    assert pair.phrase.fields["correlation"] == pytest.approx(-0.97, abs=0.03)
    for name, t in result.significance().items():
        assert t == pytest.approx(abs(result.parameters[name]) / result.mean_errors[name])
    none = plates.seen(plates.quiet(plate), plates.changed(result.solved.parameters, K5=0.0))
    weak = calibrate(plates.noisy(none, np.random.default_rng(57)))
    assert weak.significance()["K5"] < 1.96
    assert fields_of(weak.messages, "stars.weak-terms")["terms"][0].fields["name"] == "K5"


def test_means_of_a_star_are_radial_and_tangential(plate):
    """An outward mean residual is radial, positive; one that leads round from x to y is tangential."""
    result = calibrate(plates.quiet(plate))
    rows = list(star_means(result))
    assert [star for star, *_ in rows] == list(plate.star_ids)
    for star, mean, residual, (radial, tangential) in rows:
        chosen = plate.image_stars == plate.star_ids.index(star)
        assert mean == pytest.approx(plate.image_xy[chosen].mean(axis=0))
        assert residual == pytest.approx(result.solved.residuals[chosen].mean(axis=0))
        outward = mean / np.linalg.norm(mean)
        across = np.array([-outward[1], outward[0]])
        assert radial * outward + tangential * across == pytest.approx(residual, abs=1e-18)


def test_the_transformed_distortion_vanishes_at_the_crossover(plate):
    options = replace(plates.quiet(plate).options, crossover=0.06, interval=0.01, extent=0.1)
    curves = distortion_curves(calibrate(replace(plate, options=options)))
    assert curves.transformed[6] == pytest.approx(0.0, abs=1e-18)
    assert curves.transformed_error[6] == pytest.approx(0.0, abs=1e-18)
    assert curves.transformed[5] - curves.radial[5] == pytest.approx(curves.scale * 0.05, rel=1e-9)


def test_an_ellipse_has_the_axes_and_the_direction_of_its_covariance():
    """Three seconds long, one wide, thirty degrees from east towards north, at a declination of sixty."""
    turn, dec = np.radians(30.0), np.radians(60.0)
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    on_sphere = axes @ np.diag([9.0, 1.0]) @ axes.T
    in_places = np.diag([1 / np.cos(dec), 1.0]) @ on_sphere @ np.diag([1 / np.cos(dec), 1.0])
    ((major, minor, direction),) = mean_error_ellipses(in_places[None], np.array([dec]))
    assert (major, minor) == (pytest.approx(3.0), pytest.approx(1.0))
    assert direction == pytest.approx(turn)
