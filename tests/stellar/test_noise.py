"""Monte-Carlo at the noise of the computed references: 3 um on the plate, 0.2 arcsec in the catalogue."""

from dataclasses import replace

import numpy as np
import pytest
import star_plates as plates

from photogram.stellar import ARCSEC, INDEX, NAMES, calibrate
from photogram.stellar.movement import movement, pairs_to_combine

RUNS = 120


def quadratic(result, off):
    """Return the deviations of the estimated parameters over their cofactors: chi-squared were all linear."""
    own = np.flatnonzero(result.solved.free)
    cofactors = result.solved.cofactors[np.ix_(own, own)]
    sd = np.sqrt(np.diag(cofactors))
    return off[own] / sd @ np.linalg.solve(cofactors / np.outer(sd, sd), off[own] / sd)


def many(truth, runs, seed, factor=1.0, held=()):
    """Calibrate noisy plates; return parameters, mean errors, m, quadratic forms and likelihood ratios."""
    generator = np.random.default_rng(seed)
    sd = factor * plates.PLATE_SD
    fixed, all_held = np.isin(NAMES, held), np.ones(26, bool)
    found = []
    for _ in range(runs):
        made = plates.noisy(truth, generator, sd, factor * plates.STAR_SD)
        result = calibrate(replace(made, fixed=fixed))
        assert result.converged
        off = result.solved.parameters - truth.initial
        # What holding the camera at the truth costs, however the camera is parametrized.
        true = calibrate(replace(made, fixed=all_held))
        ratio = sum(true.solved.sums) - sum(result.solved.sums)
        errors = sd * np.sqrt(np.diag(result.solved.cofactors))
        found.append((off, errors, result.mean_error / sd, quadratic(result, off) / sd**2, ratio / sd**2))
    return [np.array(values) for values in zip(*found, strict=True)]


@pytest.fixture(scope="module")
def golden_noise(truth):
    return many(truth, RUNS, 11)


def test_parameters_are_unbiased_and_their_mean_errors_right(golden_noise):
    off, errors, unit, _, _ = golden_noise
    standardized = off[:, :22] / errors[:, :22]
    assert np.abs(standardized.mean(axis=0)).max() < 3.5 / np.sqrt(RUNS)
    assert np.abs(standardized.std(axis=0) - 1.0).max() < 3.5 / np.sqrt(2 * RUNS)
    assert unit.mean() == pytest.approx(1.0, abs=4 / np.sqrt(2 * 728 * RUNS))


def test_the_whole_covariance_is_right(golden_noise):
    """Likelihood ratio of the true camera: chi-squared of 22 degrees of freedom."""
    ratio = golden_noise[-1]
    assert ratio.mean() == pytest.approx(22.0, abs=3.5 * np.sqrt(44 / RUNS))
    # 5 % of them exceed 33.9.
    assert np.mean(ratio > 33.924) == pytest.approx(0.05, abs=3.5 * np.sqrt(0.05 * 0.95 / RUNS))


def test_what_the_quadratic_form_has_too_much_is_the_centre_of_distortion(truth, golden_noise):
    """It is known to 1.3 mm: so far a cubic distortion is not linear.

    The excess, a tenth, goes away with the noise, and with a centre that is held.
    """
    excess = np.mean(golden_noise[3] - golden_noise[4])
    assert 0.5 < excess < 6
    *_, form, ratio = many(truth, 30, 11, factor=0.1)
    assert np.abs(form - ratio).mean() < 0.2
    *_, form, ratio = many(truth, 40, 11, held=("dx", "dy"))
    assert np.mean(form - ratio) == pytest.approx(0.0, abs=0.3)


def test_unknown_directions_lie_in_their_ellipses(truth):
    generator = np.random.default_rng(12)
    unknown = np.arange(0, 75, 5)
    inside = []
    for _ in range(60):
        made = plates.noisy(truth, generator)
        weights = made.star_weights.copy()
        weights[unknown] = 0
        result = calibrate(replace(made, star_weights=weights))
        ellipses = result.ellipses()
        for star in unknown:
            ra, dec = result.solved.places[star] - truth.star_places[star]
            along = np.array([ra * np.cos(truth.star_places[star, 1]), dec])
            major, minor, direction = ellipses[star]
            c, s = np.cos(direction), np.sin(direction)
            scaled = np.array([[c, s], [-s, c]]) @ along / [major, minor]
            inside.append(scaled @ scaled)
    # 900 directions, those of a plate correlated: 15 % of error for the sixty at the worst, seen 2 %.
    inside = np.array(inside)
    assert np.mean(inside < 1.0) == pytest.approx(1 - np.exp(-0.5), abs=0.06)
    assert np.mean(inside < 5.991) == pytest.approx(0.95, abs=0.03)
    assert np.mean(inside) == pytest.approx(2.0, abs=0.25)


@pytest.fixture(scope="module")
def still(truth):
    """Return a plate whose camera has not moved."""
    one = truth.initial.copy()
    one[0:3] = one[3:6] = one[6:9]
    return plates.seen(truth, one)


def test_false_alarms_of_the_movement_test(still):
    """The test compares the length of a vector with its mean error along itself.

    The ratio lies between the lengths of one and of two normal variables, as the axes of the vector's
    covariance differ: false alarms beyond k mean errors are between 2 Phi(-k) and exp(-k^2 / 2). Which, the
    scatter over the runs says.
    """
    generator = np.random.default_rng(31)
    runs = [movement(calibrate(plates.noisy(still, generator))) for _ in range(250)]
    sample = np.random.default_rng(1)
    for point in (0, 8, 9, 18):
        pair, k = divmod(point, 9)
        ratio = np.array([run.angles[pair, k] / run.mean_errors[pair, k] for run in runs])
        scatter = np.cov(np.array([run.differences[pair, k, :2] for run in runs]).T)
        vectors = sample.multivariate_normal(np.zeros(2), scatter, 100_000, method="cholesky")
        square = np.sum(vectors**2, axis=1)
        expected = square / np.sqrt(np.einsum("ni,ij,nj->n", vectors, scatter, vectors))
        assert np.mean(ratio**2) == pytest.approx(np.mean(expected**2), rel=0.2)
        for k, low, high in ((1.0, 0.317, 0.607), (2.0, 0.0455, 0.135)):
            rate = np.mean(expected > k)
            assert low - 0.01 < rate < high + 0.01
            assert np.mean(ratio > k) == pytest.approx(rate, abs=3.5 * np.sqrt(rate * (1 - rate) / len(runs)))
        assert np.mean(ratio > 3.0) < 0.03


def test_a_movement_is_found(still):
    """Of the whole camera at the plate's centre; a turn about the axis shows at the edge only."""
    generator = np.random.default_rng(32)
    movement_of = 100 * ARCSEC
    moved = plates.changed(still.initial, omega_pre=still.initial[INDEX["omega_pre"]] + movement_of)
    test = movement(calibrate(plates.noisy(plates.seen(still, moved), generator)))
    assert test.pairs[0] == ("pre", "post")
    angle, error = test.angles[0, 0], test.mean_errors[0, 0]
    assert error < 8 * ARCSEC
    assert angle == pytest.approx(movement_of, abs=4 * error)
    assert pairs_to_combine(test, 3.0) == (("post", "event"),)
    turned = plates.changed(still.initial, kappa_pre=still.initial[INDEX["kappa_pre"]] + movement_of)
    test = movement(calibrate(plates.noisy(plates.seen(still, turned), generator)))
    assert test.angles[0, 0] < 4 * test.mean_errors[0, 0]
    sine = np.sin(np.arctan2(0.08 * np.sqrt(2), 0.3))
    assert test.angles[0, 8] == pytest.approx(movement_of * sine, abs=4 * test.mean_errors[0, 8])
