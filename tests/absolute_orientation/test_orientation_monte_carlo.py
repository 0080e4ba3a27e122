"""Covariances against repeated noise: parameters, transformed points, test values."""

import numpy as np
import pytest
from orientation_models import MIXED, simulate
from scipy import stats

from photogram import orient

RUNS = 1500
MODEL_SD = 0.004
POINTS = np.array([[0.3, 0.2, 0.1], [-0.6, 0.4, 0.0], [0.0, 0.0, 2.0]]) * [1000, 800, 200]


def check_mean_square(errors, covariance):
    """Check that e^T C^-1 e of many runs has the mean and the distribution of chi squared."""
    squares = np.einsum("ri,ij,rj->r", errors, np.linalg.inv(covariance), errors)
    assert stats.kstest(squares, stats.chi2(errors.shape[1]).cdf).pvalue > 1e-3


def tangent_errors(results, truth):
    """Errors of the seven tangent parameters, which are small rotations where angles may wrap."""
    rows = []
    for similarity in (result.similarity for result in results):
        change = similarity.rotation @ truth.rotation.T
        rotation = [change[1, 2], change[2, 0], change[0, 1]]
        shift = truth.to_model(similarity.control_centre[np.newaxis])[0] - similarity.model_centre
        rows.append([*rotation, similarity.scale - truth.scale, *(similarity.shift - shift)])
    return np.array(rows)


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("angles", [(0.1, -0.05, 2.0), (0.3, np.pi / 2, 0.4)])
def test_covariances(weighted, angles):
    generator = np.random.default_rng(1962)
    model = simulate(generator, angles=angles)
    shape = (len(MIXED), 3)
    control_sd = generator.uniform(0.005, 0.04, shape) if weighted else np.zeros(shape)
    model_sd = generator.uniform(0.5, 2, shape) * MODEL_SD if weighted else np.full(shape, MODEL_SD)
    options = {"control_sd": control_sd, "model_sd": model_sd}
    results = []
    for _ in range(RUNS):
        errors = (sd * generator.standard_normal(shape) for sd in (control_sd, model_sd))
        results.append(orient(model.stations(*errors, **options), unit_variance="unity"))
    exact = orient(model.stations(**options), unit_variance="unity")
    check_mean_square(tangent_errors(results, model.truth), exact.similarity.tangent_covariance)

    points = model.truth.to_model(POINTS)
    _, covariances = exact.similarity.transform(points)
    errors = np.array([result.similarity.transform(points)[0] for result in results]) - POINTS
    for k, covariance in enumerate(covariances):
        check_mean_square(errors[:, k], covariance)

    freedom = exact.degrees_of_freedom
    squares = [result.weighted_sum_of_squares for result in results]
    assert stats.kstest(squares, stats.chi2(freedom).cdf).pvalue > 1e-3
    tests = np.array([result.standardized[result.used] for result in results])
    for column in tests.T:
        assert stats.kstest(column, stats.norm.cdf).pvalue > 1e-4


def test_the_seven_parameters_and_a_point_with_errors_of_its_own():
    """Omega, phi, kappa, s, B with the covariance of the document, sigma0 being estimated."""
    generator = np.random.default_rng(3)
    model = simulate(generator, angles=(0.1, -0.05, 2.0))
    truth = np.array([0.1, -0.05, 2.0, model.truth.scale, *model.truth.translation])
    point = model.truth.to_model(POINTS[:1])
    parameters, inside, errors = [], [], []
    for _ in range(RUNS):
        error = MODEL_SD * generator.standard_normal((len(MIXED), 3))
        result = orient(model.stations(model_error=error))
        similarity = result.similarity
        found = np.array([*similarity.angles, similarity.scale, *similarity.translation])
        parameters.append((found - truth) / np.sqrt(np.diag(similarity.covariance)))
        measured = point + MODEL_SD * generator.standard_normal((1, 3))
        position, covariance = similarity.transform(measured, MODEL_SD)
        errors.append(position[0] - POINTS[0])
        inside.append(np.diag(covariance[0]))
    # With sigma0 estimated, each parameter divided by its standard deviation follows Student.
    student = stats.t(int(np.sum([len(kind) for kind in MIXED])) - 7)
    for column in np.array(parameters).T:
        assert stats.kstest(column, student.cdf).pvalue > 1e-3
    assert np.mean(np.square(errors), axis=0) == pytest.approx(np.mean(inside, axis=0), rel=0.15)
