"""Hundreds of realisations of the errors: covariances and standard deviations are right."""

import math

import numpy as np
import pytest
from plates import QUICK, STRAIGHT, bent, noisy

from photogram.comparator import Grid, Options, calibrate, simulate_calibration
from photogram.comparator.correction import partials_of

RUNS = 240
LINEAR = Options(joint=False, polynomial=False)


def excess(values, expected):
    """Return how many standard errors the mean of some values is from what was expected."""
    return abs(np.mean(values) - expected) / (np.std(values, ddof=1) / math.sqrt(len(values)))


@pytest.fixture(scope="module")
def linear_runs():
    """Return calibrations of readings with Gaussian errors, on a grid without."""
    grid = Grid.square()
    return [
        calibrate(noisy(seed, grid=grid, grid_um=0.0, pointing_um=0.5, random_um=0.8), LINEAR)
        for seed in range(RUNS)
    ]


def deviations(parameters, covariance):
    truth = [STRAIGHT.scale_x, STRAIGHT.scale_y, STRAIGHT.nonorthogonality_rad]
    return (np.array(parameters) - truth) / np.sqrt(np.diag(covariance)[:3])


def test_feature_13_covariances_of_one_case_are_unbiased(linear_runs):
    """Deviations over standard deviations have variance dof / (dof - 2), as Student has it."""
    values = []
    for calibration in linear_runs:
        fit = calibration.cases[0].linear
        own = fit.parameters
        values.append(deviations([own.scale_x, own.scale_y, own.nonorthogonality_rad], fit.covariance))
    squares = np.array(values) ** 2
    for parameter in range(3):
        assert excess(squares[:, parameter], 44 / 42) < 3.5


def test_feature_16_covariances_of_the_weighted_mean_are_unbiased(linear_runs):
    values, mahalanobis = [], []
    for calibration in linear_runs:
        own, covariance = calibration.linear.correction, calibration.linear.covariance
        parameters = [own.scale_x, own.scale_y, own.nonorthogonality_rad]
        values.append(deviations(parameters, covariance))
        whitened = np.linalg.solve(
            np.linalg.cholesky(covariance / np.outer(*[np.sqrt(np.diag(covariance))] * 2)), values[-1]
        )
        mahalanobis.append(whitened @ whitened)
    assert excess(mahalanobis, 3 * 185 / 183) < 3.5
    assert np.abs(np.mean(values, axis=0)).max() < 4 / math.sqrt(RUNS)


def test_feature_16_sigma0_is_unbiased(linear_runs):
    # Five pointings a point, eight on the first.
    variance = 0.8**2 + 0.5**2 * (24 / 5 + 1 / 8) / 25
    assert excess([calibration.linear.sigma0_um**2 for calibration in linear_runs], variance) < 3.5


@pytest.fixture(scope="module")
def full_runs():
    """Return calibrations with all errors: pointings, comparator, grid."""
    options = Options(estimate_grid=True)
    return [
        calibrate(noisy(seed, correction=bent(), pointing_um=0.5, random_um=0.6, grid_um=0.4), options)
        for seed in range(1000, 1000 + 100)
    ]


def test_feature_20_grid_sigma_is_unbiased(full_runs):
    squares = [calibration.plates[1].unbiased_um ** 2 for calibration in full_runs]
    assert excess(squares, 0.16) < 3.5
    listed = [calibration.plates[1].listed.grid_um ** 2 for calibration in full_runs]
    # What the listing passes over: six of fifty degrees of freedom of the averages, and those of the
    # residuals.
    assert np.mean(listed) < np.mean(squares)


def test_feature_20_grid_sigma_is_unbiased_where_points_are_missing():
    """Expectations of the sums of squares follow the placements and points that there are."""
    from test_comparator_input import without

    squares = []
    for seed in range(120):
        session = noisy(seed, grid_um=0.5, pointing_um=0.3, random_um=0.4, cases=5)
        session = without(session, 1, lambda case: ~np.isin(case.points, [7, 8, 20]))
        session = without(session, 4, lambda case: case.points % 2 == 1)
        squares.append(calibrate(session, QUICK).plates[1].unbiased_um ** 2)
    assert excess(squares, 0.25) < 3.5


def test_joint_components_are_unbiased(full_runs):
    assert excess([c.joint.plates[1].sigma_um ** 2 for c in full_runs], 0.16) < 3.5
    random = [calibration.joint.random_um**2 for calibration in full_runs]
    assert excess(random, 0.36) < 3.5
    assert all(calibration.joint.sigma0 == pytest.approx(1.0, abs=1e-3) for calibration in full_runs)


def test_joint_covariances_of_corrected_coordinates_and_grid(full_runs):
    """Errors of corrected places follow their covariance, but for a rotation and a shift.

    Nothing determines these two; the distance between two corrected places is free of them.
    """
    ends = np.array(
        [[30_000.0, 40_000.0], [210_000.0, 220_000.0], [30_000.0, 220_000.0], [210_000.0, 40_000.0]]
    )
    true = bent().apply(ends)
    ratios = []
    for calibration in full_runs:
        correction = calibration.joint.correction
        found = correction.apply(ends)
        by_parameters, _ = partials_of(correction, ends)
        for i, j in ((0, 1), (2, 3)):
            along = (true[j] - true[i]) / np.hypot(*(true[j] - true[i]))
            error = along @ ((found[j] - found[i]) - (true[j] - true[i]))
            partials = along @ (by_parameters[j] - by_parameters[i])
            ratios.append(error**2 / (partials @ correction.covariance @ partials))
    assert excess(ratios, 1.0) < 3.5


def test_joint_covariance_of_the_grid_errors():
    """Adjusted less true grid coordinates, over their standard deviations."""
    ratios = []
    for seed in range(60):
        simulation = simulate_calibration(
            Grid.square(sigma_um=0.4), STRAIGHT, seed=seed, pointing_um=0.5, random_um=0.6, grid_um=0.4
        )
        plate = calibrate(simulation.session).joint.plates[1]
        errors = plate.corrections_um - simulation.grid_errors_um
        variances = np.diagonal(plate.covariance_um2, axis1=1, axis2=2)
        ratios.append(float((errors**2 / variances).mean()))
    assert excess(ratios, 1.0) < 3.5


def test_even_grid_errors_show_and_odd_ones_hide():
    """Quarter turns show even shapes of the grid; cubic ones and scale go into the comparator."""
    grid = Grid.square()
    x, y = (grid.xy_um / 1e5).T
    even = np.column_stack([x**2 - (x**2).mean(), y**2 - (y**2).mean()])
    cubic = np.column_stack([x**3, y**3])
    for shape, shown in ((even, True), (cubic, False), (grid.xy_um / 1e5, False)):
        # Along the axes: turned a little, cubic shapes have cross terms that the polynomials have not.
        session = simulate_calibration(grid, STRAIGHT, grid_errors_um=shape, rotation_rad=0.0).session
        found = calibrate(session, QUICK).plates[1].averages.corrections_um
        if shown:
            assert found == pytest.approx(shape, abs=1e-4)
        else:
            assert np.abs(found).max() < 0.02 * np.abs(shape).max()


def test_corrected_grids_say_their_own_uncertainty():
    """Not that of the given coordinates: averages of few cases may be worse than these."""
    said, off = [], {"averages": [], "joint": []}
    for seed in range(60):
        made = simulate_calibration(
            Grid.square(sigma_um=0.4), bent(), pointing_um=0.5, random_um=0.6, grid_um=0.4, seed=seed
        )
        calibration = calibrate(made.session)
        grids = {"averages": calibration.corrected_grid(1), "joint": calibration.adjusted_grid(1)}
        true = made.session.grids[1].xy_um + made.grid_errors_um
        for name, grid in grids.items():
            off[name].append(float(((grid.xy_um - true) ** 2).mean() / grid.sigma_um**2))
        said.append([grid.sigma_um for grid in grids.values()])
    assert excess(off["averages"], 1.0) < 3.5
    assert excess(off["joint"], 1.0) < 3.5
    averages, joint = np.mean(said, axis=0)
    assert joint < averages
    assert grids["joint"].adopted == "undated by comparator 1, from the values of an unknown date"
