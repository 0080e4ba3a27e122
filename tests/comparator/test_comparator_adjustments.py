"""Orientation, rigid, linear and polynomial adjustments of one case and of all."""

import math
from dataclasses import replace

import numpy as np
import pytest
from plates import ARCSEC, LINEAR, QUICK, STRAIGHT, bent, case_2, document, noisy, printed_correction

from photogram.comparator import (
    Correction,
    Decomposition,
    Frame,
    Grid,
    Options,
    Polynomial,
    calibrate,
    simulate_calibration,
)
from photogram.comparator.case import locations
from photogram.comparator.fits import (
    decomposition_jacobian,
    design,
    fit_affine,
    fit_polynomial,
    fit_rigid,
    rotation_matrix,
)

POINTS = np.arange(1, 26)
GRID = Grid.square().xy_um


def derived():
    return document("derived_reference.json")["case2"]


# 10: orientation


def test_feature_10_case_2_has_point_25_nearest_the_origin():
    orientation = case_2().cases[0].placed.orientation
    assert (orientation.corner, orientation.nearest_point, orientation.left_handed) == (3, 25, True)


@pytest.mark.parametrize("left_handed", [False, True])
def test_feature_10_every_quarter_turn_is_detected(left_handed):
    session = simulate_calibration(Grid.square(), STRAIGHT, left_handed=left_handed).session
    calibration = calibrate(session, LINEAR)
    nearest = [case.placed.orientation.nearest_point for case in calibration.cases]
    assert nearest == ([1, 5, 25, 21] if left_handed else [1, 21, 25, 5])
    for case in calibration.cases:
        measured = np.hypot(*case.placed.means_um.T)
        corners = {
            int(p): d for p, d in zip(case.placed.points, measured, strict=True) if p in (1, 5, 21, 25)
        }
        assert case.placed.orientation.nearest_point == min(corners, key=corners.get)


def test_feature_10_locations_are_a_group_of_permutations():
    """The listing's formulas (COMPVS): after turning, location i is where point i would be."""
    grid = Grid.square()
    maps = {corner: locations(grid, corner) for corner in (1, 2, 3, 4)}
    i = np.arange(1, 26)
    quarter = 26 + (i - 1) // 5 - 5 * (i - 5 * ((i - 1) // 5))
    assert maps[1].tolist() == i.tolist()
    assert maps[3].tolist() == (26 - i).tolist()
    assert maps[4].tolist() == quarter.tolist()
    assert maps[2].tolist() == quarter[25 - i].tolist()
    four_times = i
    for _ in range(4):
        four_times = maps[4][four_times - 1]
    assert four_times.tolist() == i.tolist()
    for corner, nearest in ((2, 21), (3, 25), (4, 5)):
        assert maps[corner][nearest - 1] == 1


def test_feature_10_plates_that_do_not_meet_themselves():
    square = Grid.square()
    oblong = replace(square, xy_um=square.xy_um * [1.0, 1.5])
    assert locations(oblong, 3).tolist() == (26 - POINTS).tolist()
    assert locations(oblong, 4) is None


# 11: free adjustment


def kabsch(measured, grid):
    """Return the rigid fit by singular values, without scale."""
    middle, grid_middle = measured.mean(axis=0), grid.mean(axis=0)
    u, _, vt = np.linalg.svd((measured - middle).T @ (grid - grid_middle))
    turn = vt.T @ np.diag([1.0, np.linalg.det(vt.T @ u.T)]) @ u.T
    return turn, (measured - middle) @ turn.T + grid_middle - grid


def test_feature_11_the_free_adjustment_is_the_rigid_fit():
    rng = np.random.default_rng(11)
    measured = (GRID @ rotation_matrix(2.5)) * [1.00001, 0.99998] + 3e5 + rng.standard_normal((25, 2))
    fit = fit_rigid(POINTS, measured, GRID)
    turn, residuals = kabsch(measured, GRID)
    assert rotation_matrix(fit.rotation_rad) == pytest.approx(turn, abs=1e-12)
    assert fit.residuals.grid_um == pytest.approx(residuals, abs=1e-7)
    moved = measured @ rotation_matrix(fit.rotation_rad).T + fit.translation_um
    assert moved - GRID == pytest.approx(residuals, abs=1e-7)
    exact = -residuals @ rotation_matrix(fit.rotation_rad)
    assert fit.residuals.comparator_um == pytest.approx(exact, rel=1e-4)
    assert (fit.residuals.comparator_um != exact).any()


def test_feature_11_free_adjustment_of_case_2():
    free, expected = case_2().cases[0].free, derived()["free_fit"]
    assert math.degrees(free.rotation_rad) == pytest.approx(expected["theta_deg"], rel=1e-6)
    assert free.residuals.squares_um2 == pytest.approx(tuple(expected["sum_vv_um2"].values()), rel=1e-6)
    assert free.residuals.sigma0_um == pytest.approx(expected["sigma0_um"], rel=1e-6)


# 12: linear adjustment and decomposition


@pytest.mark.parametrize("rotation", [0.0, math.pi / 2, math.pi, -math.pi / 2, 0.2, 2.9, -1.3])
@pytest.mark.parametrize("lean", [0.0, 5e-5, -0.3])
def test_feature_12_the_decomposition_is_exact(rotation, lean):
    given = Decomposition(1.02, 0.97, lean, rotation)
    found = Decomposition.of_inverse(np.linalg.inv(given.matrix))
    assert (found.scale_x, found.scale_y) == pytest.approx((1.02, 0.97), abs=1e-14)
    assert found.nonorthogonality_rad == pytest.approx(lean, abs=1e-14)
    assert math.remainder(found.rotation_rad - rotation, 2 * math.pi) == pytest.approx(0.0, abs=1e-14)


def test_feature_12_the_linear_adjustment_is_least_squares():
    rng = np.random.default_rng(12)
    measured = GRID @ rotation_matrix(0.7) + 2e5 + rng.standard_normal((25, 2))
    fit = fit_affine(POINTS, measured, GRID)
    matrix = np.column_stack([GRID / 1e5, np.ones(25)])
    solution, squares, *_ = np.linalg.lstsq(matrix, measured, rcond=None)
    assert fit.coefficients == pytest.approx(solution[:2].T / 1e5, abs=1e-12)
    assert fit.shift_um == pytest.approx(solution[2], abs=1e-6)
    assert fit.residuals.squares_um2[:2] == pytest.approx(tuple(squares), rel=1e-9)
    assert fit.residuals.sigma0_um == pytest.approx(math.sqrt(squares.sum() / 44), rel=1e-9)
    moved = measured @ fit.parameters.matrix.T + fit.translation_um
    assert moved - GRID == pytest.approx(fit.residuals.grid_um, abs=1e-7)


def test_feature_12_linear_adjustment_of_case_2():
    fit, expected = case_2().cases[0].linear, derived()["linear"]
    own = fit.parameters
    assert 1e6 * (own.scale_x - 1) == pytest.approx(expected["SX_minus1_um_per_m"], rel=1e-6)
    assert 1e6 * (own.scale_y - 1) == pytest.approx(expected["SY_minus1_um_per_m"], rel=1e-6)
    assert own.nonorthogonality_rad / ARCSEC == pytest.approx(expected["alpha_arcsec"], rel=1e-6)
    assert math.degrees(own.rotation_rad) == pytest.approx(expected["theta_deg"], rel=1e-6)
    assert fit.residuals.sigma0_um == pytest.approx(expected["sigma0_um"], rel=1e-6)
    assert fit.residuals.squares_um2 == pytest.approx(tuple(expected["sum_vv_um2"].values()), rel=1e-6)
    vectors = np.column_stack([expected["vx_um"], expected["vy_um"]])
    order = np.argsort(fit.residuals.points)
    found = fit.residuals.comparator_um[order]
    assert np.abs(found - vectors).max() < 5.1e-5


@pytest.mark.parametrize("quarter", range(4))
def test_feature_12_a_plate_that_lies_exactly_along_the_axes(quarter):
    """The listing divides by b and d, which are zero here."""
    session = simulate_calibration(
        Grid.square(), Correction(1.0, 1.0, 0.0), cases=1, rotation_rad=quarter * math.pi / 2
    )
    case = calibrate(session.session, LINEAR).cases[0]
    assert case.linear.parameters.scale_x == pytest.approx(1.0, abs=1e-13)
    assert np.isfinite(case.linear.cofactors).all()


# 13: covariances


@pytest.mark.parametrize("rotation", [0.0, 0.4, math.pi / 2, -2.0])
def test_feature_13_partials_of_the_decomposition(rotation):
    """Complex steps through the formulas of equation 47."""
    matrix = np.linalg.inv(Decomposition(1.01, 0.98, 0.1, rotation).matrix)

    def parameters(a, b, c, d):
        delta = a * d - b * c

        def arctan(y, x):  # the branch does not change derivatives
            return np.arctan(y / x) if abs(x.real) > abs(y.real) else -np.arctan(x / y)

        return [
            np.sqrt(c * c + d * d) / delta,
            np.sqrt(a * a + b * b) / delta,
            arctan(-(a * c + b * d), delta),
            arctan(c, d),
        ]

    jacobian = decomposition_jacobian(matrix)
    for column in range(4):
        values = matrix.ravel().astype(complex)
        values[column] += 1e-30j
        derivative = [value.imag / 1e-30 for value in parameters(*values)]
        assert jacobian[:, column] == pytest.approx(derivative, rel=1e-10, abs=1e-12)


def test_feature_13_covariance_of_case_2():
    expected = np.array(derived()["linear"]["cov_SX_SY_alpha_theta"])
    found = case_2().cases[0].linear.covariance
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert (found - expected) / scale == pytest.approx(np.zeros((4, 4)), abs=1e-6)


# 14: residuals in both systems


def test_feature_14_residuals_of_both_systems_are_opposite():
    for fit in case_2().cases[0].linear, case_2().cases[0].free, case_2().last_fits[0]:
        rotation = getattr(fit, "rotation_rad", None) or fit.parameters.rotation_rad
        turned = -fit.residuals.comparator_um @ rotation_matrix(rotation).T
        assert fit.residuals.grid_um == pytest.approx(turned, abs=2e-3)
        x, y, grid_x, grid_y = fit.residuals.squares_um2
        assert x + y == pytest.approx(grid_x + grid_y, rel=2e-4)


def test_feature_14_signs_of_residuals():
    """Comparator residuals are to be added to the measurement, grid residuals to the grid."""
    session = simulate_calibration(Grid.square(), STRAIGHT, cases=1).session
    case = session.cases[0]
    xy = case.xy_um.copy()
    xy[case.points == 13] += [5.0, 0.0]
    calibration = calibrate(replace(session, cases=(replace(case, xy_um=xy),)), LINEAR)
    residuals = calibration.last_fits[0].residuals
    middle = residuals.points == 13
    assert residuals.comparator_um[middle][0, 0] < -4.5
    expected = rotation_matrix(math.atan(0.2)) @ [5.0, 0.0]
    assert residuals.grid_um[middle][0] == pytest.approx(expected * 24 / 25, rel=1e-3)


# 15: polynomials of one case


def test_feature_15_polynomials_of_case_2():
    single, expected = case_2().cases[0].polynomial, derived()["nonlinear_single_case"]
    coefficients = np.array([list(expected["coef_x"].values()), list(expected["coef_y"].values())])
    # The reference solved the normal equations: their condition of 8e9 leaves it fewer digits in G, H, J.
    found = single.polynomial.coefficients
    places = single.residuals.xy_um
    reference = Polynomial.from_metres(*coefficients).evaluate(places)
    assert np.abs(single.polynomial.evaluate(places) - reference).max() < 1e-5
    assert found[:, :6] == pytest.approx(coefficients[:, :6], rel=1e-6)
    assert single.residuals.squares_um2[:2] == pytest.approx(tuple(expected["sum_vv_um2"].values()), rel=1e-6)
    assert single.residuals.sigma0_um == pytest.approx(expected["sigma0_um"], rel=1e-6)


def test_feature_15_the_sign_of_the_listing_has_a_name():
    session = noisy(3)
    ours, listed = (
        calibrate(session, Options(joint=False, as_published=way)).cases[0].polynomial.residuals
        for way in (False, True)
    )
    order, listed_order = ours.points.argsort(), listed.points.argsort()
    assert ours.comparator_um[order] == pytest.approx(listed.comparator_um[listed_order])
    assert ours.grid_um[order] == pytest.approx(-listed.grid_um[listed_order])


def test_feature_15_scaled_columns_mend_the_condition():
    case = case_2().cases[0]
    places = case.polynomial.residuals.xy_um
    raw = np.linalg.cond(design(Frame.metres(), places).T @ design(Frame.metres(), places))
    assert raw == pytest.approx(derived()["nonlinear_single_case"]["normal_matrix_condition"], rel=1e-3)
    assert np.linalg.cond(design(Frame.of(places), places)) < 100
    polynomial = fit_polynomial(places, case.linear.residuals.comparator_um)
    metres = Polynomial.from_metres(*polynomial.coefficients)
    assert metres.evaluate(places) == pytest.approx(polynomial.evaluate(places), abs=1e-7)


def test_feature_15_cofactors_in_metres():
    """Cofactors of the coefficients in metres are those of the design matrix in metres."""
    case = case_2().cases[0]
    polynomial = case.polynomial.polynomial
    places = case.placed.means_um @ case.linear.parameters.linear_matrix.T
    inverse = np.linalg.inv(np.linalg.qr(design(Frame.metres(), places))[1])
    expected = inverse @ inverse.T / 1e12
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert (polynomial.cofactors[:9, :9] - expected) / scale == pytest.approx(np.zeros((9, 9)), abs=1e-6)


# 16: combined linear adjustment


def joint_least_squares(calibration):
    """Gauss-Newton with numerical partials: three unknowns of the comparator, three of each case."""
    cases = [case.placed for case in calibration.cases]

    def residuals(values):
        # Unknowns in units of their effect at 1e5 um.
        matrix = Correction(1 + values[0] * 1e-5, 1 + values[1] * 1e-5, values[2] * 1e-5)
        parts = []
        for k, case in enumerate(cases):
            theta, tx, ty = values[3 + 3 * k : 6 + 3 * k]
            base = calibration.linear.cases[k]
            turn = rotation_matrix(base.rotation_rad + theta * 1e-5)
            computed = (case.grid_um - base.translation_um - [tx, ty]) @ turn
            parts.append(np.linalg.solve(matrix.matrix, computed.T).T - case.means_um)
        return np.concatenate([part.ravel() for part in parts])

    values = np.zeros(3 + 3 * len(cases))
    for _ in range(6):
        base = residuals(values)
        jacobian = np.column_stack(
            [
                (residuals(values + step) - residuals(values - step)) / 0.2
                for step in 0.1 * np.eye(len(values))
            ]
        )
        values = values - np.linalg.lstsq(jacobian, base, rcond=None)[0]
    base = residuals(values)
    cofactors = np.linalg.inv(jacobian.T @ jacobian)[:3, :3] * 1e-10
    return values[:3] * 1e-5, base @ base, cofactors


def test_feature_16_the_weighted_mean_is_the_joint_solution():
    calibration = calibrate(noisy(16, correction=bent()), LINEAR)
    linear = calibration.linear
    values, squares, cofactors = joint_least_squares(calibration)
    mean = linear.correction
    found = np.array([mean.scale_x - 1, mean.scale_y - 1, mean.nonorthogonality_rad])
    sd = np.sqrt(np.diag(linear.covariance))
    assert (found - values) / sd == pytest.approx(np.zeros(3), abs=1e-4)
    assert linear.sigma0_um**2 * linear.degrees_of_freedom == pytest.approx(squares, rel=1e-6)
    assert linear.degrees_of_freedom == 200 - 15
    scale = np.outer(sd, sd)
    assert (linear.covariance - linear.sigma0_um**2 * cofactors) / scale == pytest.approx(
        np.zeros((3, 3)), abs=1e-3
    )


def test_feature_16_residual_sigma_of_a_case():
    """The listing's denominator for each axis: N - (3 + 3/q) / 2."""
    calibration = calibrate(noisy(16), LINEAR)
    residuals = calibration.linear.cases[0].residuals
    x, y, *_ = residuals.squares_um2
    assert residuals.sigma0_um == pytest.approx(math.sqrt((x + y) / (2 * (25 - 0.5 * (3 + 3 / 4)))))


@pytest.mark.parametrize("left_handed", [False, True])
@pytest.mark.parametrize("cases", [1, 4])
def test_feature_16_linear_parameters_without_noise(left_handed, cases):
    session = simulate_calibration(Grid.square(), STRAIGHT, cases=cases, left_handed=left_handed).session
    calibration = calibrate(session, LINEAR)
    own = calibration.linear.correction
    assert own.scale_x == pytest.approx(STRAIGHT.scale_x, abs=1e-12)
    assert own.scale_y == pytest.approx(STRAIGHT.scale_y, abs=1e-12)
    assert own.nonorthogonality_rad == pytest.approx(STRAIGHT.nonorthogonality_rad, abs=1e-12)
    for fit in calibration.last_fits:
        assert np.abs(fit.residuals.comparator_um).max() < 1e-6


# 17: combined polynomials


def test_feature_17_combined_polynomials_recover_the_correction():
    """Compared are corrected coordinates: a rotation, a shift and scales may go either way."""
    for correction in (bent(), printed_correction()):
        session = simulate_calibration(Grid.square(sigma_um=0.2), correction).session
        calibration = calibrate(session)
        inside = np.vstack([case.placed.means_um for case in calibration.cases])
        true = correction.apply(inside)
        # Linear terms that go another way turn the arguments of the others by 1e-5: cross terms of a
        # nanometre.
        for found in (calibration.correction, calibration.joint.correction):
            moved = fit_rigid(np.arange(len(inside)), found.apply(inside), true)
            assert np.abs(moved.residuals.grid_um).max() < 1e-3


def test_feature_17_denominators():
    """Equation 62: sum of points less nine for each axis; 9/q for each case."""
    calibration = calibrate(noisy(17, correction=bent()), QUICK)
    nonlinear = calibration.nonlinear
    assert nonlinear.degrees_of_freedom == 100 - 9
    assert nonlinear.cases[0].residuals.lost == pytest.approx(9 / 4)
    linear = calibration.linear.cases
    places = np.vstack([fit.residuals.xy_um for fit in linear])
    residuals = np.vstack([fit.residuals.comparator_um for fit in linear])
    left = residuals - nonlinear.polynomial.evaluate(places)
    assert nonlinear.sigma_um == pytest.approx(tuple(np.sqrt((left**2).sum(axis=0) / 91)))


def test_scale_invariance_of_units():
    """A plate of other size in proportion gives the same dimensionless parameters."""
    big = simulate_calibration(Grid.square(5, 50_000.0), STRAIGHT).session
    small = simulate_calibration(Grid.square(5, 5_000.0), STRAIGHT, centre_um=(12_500.0, 13_000.0)).session
    for session in (big, small):
        own = calibrate(session, LINEAR).linear.correction
        assert own.scale_x == pytest.approx(STRAIGHT.scale_x, abs=1e-12)


@pytest.mark.parametrize(("columns", "count"), [(4, 16), (6, 36), (9, 81)])
def test_plates_of_any_number_of_points(columns, count):
    grid = Grid.square(columns, 200_000.0 / (columns - 1), sigma_um=0.3)
    calibration = calibrate(noisy(7, grid=grid, correction=bent()))
    assert len(calibration.plates[1].averages.points) == count
    assert 0.4 < calibration.nonlinear.sigma0_um < 1.2
    assert calibration.joint.sigma0 == pytest.approx(1.0, abs=0.05)
