"""Perspective centres of simulated grids: covariance, weights, heights, starts, test values."""

from __future__ import annotations

import numpy as np
import pytest

from message_codes import coded
from photogram import InputError, RankError
from photogram.perspective_center import Grid, determine

TRUTH = np.array([250.4, 249.7, 310.25])
MINUTES = 3437.7468


def errors_of(result, kappa=20.0):
    """Errors in the order of the covariance: omega, phi, kappa (rad), Xc, Yc, Zc."""
    attitude = np.radians(np.array([12.0, -7.0, kappa]) / 60.0)
    return np.concatenate([result.attitude - attitude, result.position - TRUTH])


@pytest.mark.parametrize(("as_published", "relief"), [(False, 0.0), (False, 15.0), (True, 0.0)])
def test_covariance_agrees_with_monte_carlo(make_grid, as_published, relief):
    initial = np.array([250.0, 250.0, 310.0, 0.0, 0.0, 0.0])
    runs = 400
    results = [
        determine(make_grid(sd=0.01, seed=seed, relief=relief, initial=initial), as_published=as_published)
        for seed in range(runs)
    ]
    errors = np.array([errors_of(result) for result in results])
    mean = np.mean([result.covariance for result in results], axis=0)
    deviations = np.sqrt(np.diagonal(mean))
    empirical = errors.T @ errors / runs
    # The entries of a correlation matrix from 400 runs scatter by 0.05 and less; 0.2 is four times that.
    np.testing.assert_allclose(
        empirical / np.outer(deviations, deviations),
        mean / np.outer(deviations, deviations),
        rtol=0,
        atol=0.25,
    )
    squares = np.einsum("ri,rij,rj->r", errors, np.linalg.inv([r.covariance for r in results]), errors)
    # 6 F(6, 44) has the mean 6.29.
    assert np.mean(squares) == pytest.approx(6 * 44 / 42, abs=0.8)


@pytest.mark.parametrize("kappa", [0.0, 5130.0])
def test_standardized_residuals_have_unit_variance_in_the_model(make_grid, kappa):
    results = [determine(make_grid(sd=0.01, seed=seed, kappa=kappa)) for seed in range(300)]
    tests = np.array([result.standardized for result in results])
    assert np.mean(tests**2) == pytest.approx(1.0, abs=0.03)
    per_component = np.mean(tests**2, axis=0)
    assert per_component.min() > 0.7
    assert per_component.max() < 1.3
    for result in results[:5]:
        assert result.redundancy.sum() == pytest.approx(result.degrees_of_freedom, abs=0.05)
        assert ((result.redundancy > 0) & (result.redundancy < 1)).all()


def test_residuals_stay_in_the_model_whatever_kappa_is(make_grid):
    turned = make_grid(sd=0.0, kappa=5130.0)
    model = turned.model.copy()
    model[7, 0] += 0.1
    result = determine(Grid(turned.ids, turned.plate_xy, model, 150.0))
    residual = result.residual[7]
    assert residual[0] > 0.05
    assert abs(residual[1]) < 0.02
    assert np.abs(result.standardized).argmax() == 14


def test_points_at_many_heights_are_projected_each_to_its_own(make_grid):
    result = determine(make_grid(relief=30.0))
    np.testing.assert_allclose(result.position, TRUTH, rtol=0, atol=1e-8)
    np.testing.assert_allclose(result.residual, 0.0, atol=1e-9)
    np.testing.assert_allclose(result.radial_distortion, 0.0, atol=1e-9)


def test_more_than_fifty_points(make_grid):
    result = determine(make_grid(across=21, sd=0.01))
    assert (len(result.grid.ids), result.degrees_of_freedom) == (441, 876)
    assert result.sigma0_model == pytest.approx(0.01, rel=0.1)


# Weights


def test_weights_by_readings(make_grid):
    counts = np.where(np.arange(25) % 2, 1, 9)
    errors, squares = [], []
    for seed in range(300):
        plain = make_grid(sd=0.01, seed=seed, weights=counts)
        grid = Grid(plain.ids, plain.plate_xy, plain.model, 150.0, readings=counts)
        result = determine(grid, weights="readings")
        np.testing.assert_allclose(result.weights, counts / counts.mean())
        error = errors_of(result)
        squares.append(error @ np.linalg.solve(result.covariance, error))
        errors.append((np.abs(errors_of(determine(grid))), np.abs(error)))
    assert np.mean(squares) == pytest.approx(6 * 44 / 42, abs=0.9)
    equal, weighted = np.mean(errors, axis=0)
    assert (weighted < equal).all()


def test_weights_by_deviations(make_grid):
    plain = make_grid(sd=0.01)
    sd = np.linspace(0.001, 0.01, 25)
    grid = Grid(
        plain.ids, plain.plate_xy, plain.model, 150.0,
        readings=np.full(25, 4), reading_sd=np.column_stack([sd, sd]),
    )  # fmt: skip
    by_deviations = determine(grid, weights="deviations")
    given = determine(grid, model_sd=sd / 2)
    np.testing.assert_allclose(by_deviations.weights, sd**-2 / np.mean(sd**-2))
    np.testing.assert_allclose(by_deviations.position, given.position, rtol=0, atol=1e-12)
    assert by_deviations.weights.mean() == pytest.approx(1.0)


def test_weights_that_cannot_be_formed(make_grid):
    grid = make_grid()
    with pytest.raises(
        InputError, match="points 1, 2", check=lambda error: error.code == "projector.no-weight"
    ):
        determine(grid, weights="deviations")
    with pytest.raises(InputError, match="weights: must be one of"):
        determine(grid, weights="best")
    with pytest.raises(InputError, match="points 1, 2"):
        determine(grid, model_sd=0.0)
    with pytest.raises(InputError, match="model_sd: must have the shape"):
        determine(grid, model_sd=[1.0, 2.0])


# Starts and faults


def test_bad_approximations_are_replaced(make_grid):
    right = determine(make_grid(sd=0.01))
    assert right.messages == []
    for initial in ([0.0] * 6, [250.0, 250.0, -310.0, 0.0, 0.0, 3.0]):
        result = determine(make_grid(sd=0.01, initial=np.array(initial)))
        np.testing.assert_allclose(result.position, right.position, rtol=0, atol=1e-8)
        assert [message.code for message in result.messages] == ["projector.direct-start"]


def test_points_behind_the_projector_are_named(make_grid):
    """The program of 1969 follows its approximations to below the model, where the equations hold as well."""
    below = make_grid(initial=np.array([250.0, 250.0, -310.0, 0.0, 0.0, 3.0]))
    result = determine(below, as_published=True)
    assert result.converged
    assert result.position[2] < 0
    assert "25 image points have their point behind the camera: points 1, 2," in str(result.messages[0])
    assert (
        determine(
            make_grid(initial=np.array([250.0, 250.0, 310.0, 0.0, 0.0, 0.3])), as_published=True
        ).messages
        == []
    )


def test_as_published_needs_approximations(make_grid):
    with pytest.raises(InputError, check=lambda error: error.code == "projector.no-approximations"):
        determine(make_grid(), as_published=True)


def test_three_points_have_no_standard_errors(make_grid):
    full = make_grid(sd=0.01)
    rows = [0, 4, 22]
    grid = Grid(
        [1, 2, 3], full.plate_xy[rows], full.model[rows], 150.0, initial=np.array([250, 250, 310, 0, 0, 0])
    )
    for as_published in (True, False):
        result = determine(grid, as_published=as_published)
        assert result.degrees_of_freedom == 0
        assert (
            result.sigma0_plate is result.sigma0_model is result.covariance is result.standard_errors is None
        )
        assert np.isnan(result.standardized).all()
        np.testing.assert_allclose(result.residual, 0.0, atol=1e-3)


def test_points_on_one_line_are_singular(make_grid):
    full = make_grid()
    grid = Grid(
        list(range(5)), full.plate_xy[:5], full.model[:5], 150.0, initial=np.array([250, 250, 310, 0, 0, 0])
    )
    with pytest.raises(RankError, match="MATRIX IS SINGULAR: the points must not be on one line"):
        determine(grid)
    with pytest.raises(RankError, match="MATRIX IS SINGULAR: the points must not be on one line"):
        determine(grid, as_published=True)


def test_grids_that_contradict_themselves_are_refused(make_grid):
    grid = make_grid()
    with pytest.raises(InputError, match=r"model: must have the shape .*, got \(3, 3\)"):
        Grid(grid.ids, grid.plate_xy, grid.model[:3], 150.0)
    with pytest.raises(InputError, check=coded("error.finite")):
        Grid(grid.ids, grid.plate_xy * np.nan, grid.model, 150.0)
    with pytest.raises(InputError, match="principal_distance"):
        Grid(grid.ids, grid.plate_xy, grid.model, -150.0)
    with pytest.raises(InputError, check=lambda error: error.code == "projector.readings"):
        Grid(grid.ids, grid.plate_xy, grid.model, 150.0, readings=np.zeros(25, dtype=int))
