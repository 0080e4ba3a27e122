"""What must hold for any model: exact recovery, invariances, partials, redundancy."""

import numpy as np
import pytest
from orientation_models import FULL, HEIGHT, HORIZONTAL, MIXED, simulate
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from photogram import orient
from photogram.absolute_orientation import Similarity, Stations

NOISE = 0.004
KINDS = {"full": (FULL,) * 6, "mixed": MIXED, "few": (HORIZONTAL, FULL, HORIZONTAL, HEIGHT, HEIGHT, HEIGHT)}


def difference(result, truth):
    rotation = np.abs(result.similarity.rotation - truth.rotation).max()
    return max(rotation, abs(result.similarity.scale / truth.scale - 1))


@pytest.mark.parametrize("kinds", KINDS.values(), ids=KINDS.keys())
@pytest.mark.parametrize("phi", [None, 0.5 * np.pi, -0.5 * np.pi, 0.5 * np.pi - 1e-9, -0.5 * np.pi + 1e-4])
def test_exact_recovery_at_any_attitude(kinds, phi):
    generator = np.random.default_rng(19)
    ambiguous = 0
    for _ in range(60):
        angles = None if phi is None else (generator.uniform(-3, 3), phi, generator.uniform(-3, 3))
        model = simulate(generator, kinds, angles=angles, scale=10 ** generator.uniform(-3, 3))
        result = orient(model.stations())
        assert result.converged
        if result.alternatives:
            ambiguous += 1
            continue
        assert difference(result, model.truth) < 1e-9
        positions, covariances = result.similarity.transform(model.exact)
        np.testing.assert_allclose(positions, model.ground, rtol=0, atol=1e-6)
        assert np.isfinite(covariances).all()
    assert ambiguous <= 3


def test_the_two_methods_agree_on_any_kappa():
    generator = np.random.default_rng(2)
    for kappa in np.linspace(-np.pi, np.pi, 13):
        model = simulate(generator, angles=(0.05, -0.08, kappa))
        noisy = model.stations(model_error=NOISE * generator.standard_normal((len(MIXED), 3)))
        rigorous, report = (orient(noisy, method=method) for method in ("rigorous", "report"))
        assert difference(report, rigorous.similarity) < 1e-8
        np.testing.assert_allclose(report.residuals, rigorous.residuals, atol=1e-5 * NOISE)
        np.testing.assert_allclose(
            report.similarity.covariance, rigorous.similarity.covariance, rtol=1e-5, atol=1e-9
        )


def noisy_stations(seed, angles=None):
    generator = np.random.default_rng(seed)
    model = simulate(generator, angles=angles)
    return model.stations(model_error=NOISE * generator.standard_normal((len(MIXED), 3)))


@pytest.mark.parametrize("angles", [(0.1, -0.2, 2.5), None])
@pytest.mark.parametrize(
    ("control_scale", "control_shift", "model_scale", "model_shift"),
    [
        (1, (5e5, 4.2e6, -300), 1, (0, 0, 0)),
        (1, (0, 0, 0), 1, (1e4, -2e4, 3e3)),
        (0.3048, (0, 0, 0), 1, (0, 0, 0)),
        (1e-3, (1, 2, 3), 1e3, (4, 5, 6)),
    ],
)
def test_origin_and_units_do_not_matter(angles, control_scale, control_shift, model_scale, model_shift):
    given = noisy_stations(5, angles)
    moved = Stations(
        given.ids, control_scale * given.control + control_shift, model_scale * given.model + model_shift
    )
    first, second = orient(given), orient(moved)
    np.testing.assert_allclose(second.similarity.rotation, first.similarity.rotation, atol=1e-9)
    assert second.similarity.scale == pytest.approx(
        first.similarity.scale * model_scale / control_scale, rel=1e-9
    )
    np.testing.assert_allclose(
        second.residuals, model_scale * first.residuals, atol=1e-6 * model_scale * NOISE
    )
    np.testing.assert_allclose(second.redundancy, first.redundancy, atol=1e-7)
    np.testing.assert_allclose(second.standardized, first.standardized, atol=1e-5)
    sd = np.sqrt(np.diag(first.similarity.covariance))[:3]
    np.testing.assert_allclose(np.sqrt(np.diag(second.similarity.covariance))[:3], sd, rtol=1e-6)
    points = given.model[:3]
    here, there = (
        first.similarity.transform(points),
        second.similarity.transform(model_scale * points + model_shift),
    )
    np.testing.assert_allclose(there[0], control_scale * here[0] + control_shift, rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(there[1], control_scale**2 * here[1], rtol=1e-5, atol=1e-9 * there[1].max())


def test_the_order_of_the_stations_does_not_matter():
    given = noisy_stations(8, (0.02, 0.03, 1.0))
    order = np.random.default_rng(0).permutation(len(given.ids))
    shuffled = Stations(order, given.control[order], given.model[order])
    first, second = orient(given), orient(shuffled)
    np.testing.assert_allclose(second.similarity.rotation, first.similarity.rotation, atol=1e-10)
    np.testing.assert_allclose(second.residuals, first.residuals[order], atol=1e-7 * NOISE)


@pytest.mark.parametrize("weighted", [False, True])
def test_redundancy_numbers_sum_to_the_degrees_of_freedom(weighted):
    generator = np.random.default_rng(3)
    for _ in range(20):
        model = simulate(generator, tuple(generator.choice([FULL, HORIZONTAL, HEIGHT], 12)) + (FULL,) * 3)
        sd = {}
        if weighted:
            sd = {
                "control_sd": generator.uniform(0, 0.05, (15, 3)),
                "model_sd": generator.uniform(0.002, 0.01, (15, 3)),
            }
        result = orient(model.stations(model_error=NOISE * generator.standard_normal((15, 3)), **sd))
        assert np.nansum(result.redundancy) == pytest.approx(result.degrees_of_freedom, abs=1e-8)
        within = result.redundancy[result.used]
        assert ((within > -1e-9) & (within < 1 + 1e-9)).all() or weighted


def test_a_zero_deviation_of_control_and_equal_ones_of_the_model_change_nothing():
    given = noisy_stations(11)
    weighted = Stations(given.ids, given.control, given.model, model_sd=0.123)
    first, second = orient(given), orient(weighted)
    np.testing.assert_allclose(second.similarity.rotation, first.similarity.rotation, atol=1e-10)
    np.testing.assert_allclose(
        second.similarity.covariance, first.similarity.covariance, rtol=1e-6, atol=1e-12
    )
    assert second.sigma0 == pytest.approx(first.sigma0 / 0.123, rel=1e-8)
    a_priori = orient(weighted, unit_variance="unity")
    np.testing.assert_allclose(
        a_priori.similarity.tangent_covariance * second.sigma0**2,
        second.similarity.tangent_covariance,
        rtol=1e-9,
    )


def test_errors_are_shared_out_between_the_systems():
    """The sum of squares in both systems is what an independent minimisation finds."""
    generator = np.random.default_rng(21)
    model = simulate(generator, angles=(0.2, -0.1, 1.0))
    count = len(MIXED)
    control_sd, model_sd = (
        generator.uniform(0.01, 0.05, (count, 3)),
        generator.uniform(0.002, 0.01, (count, 3)),
    )
    given = model.stations(
        control_sd * generator.standard_normal((count, 3)),
        model_sd * generator.standard_normal((count, 3)),
        control_sd=control_sd,
        model_sd=model_sd,
    )
    result = orient(given)

    def residuals(unknowns):
        change, scale, translation, ground = (
            unknowns[:3],
            unknowns[3],
            unknowns[4:7],
            unknowns[7:].reshape(-1, 3),
        )
        rotation = Rotation.from_rotvec(change).as_matrix() @ model.truth.rotation
        by_model = (given.model - scale * ground @ rotation.T - translation) / model_sd
        by_control = ((given.control - ground) / control_sd)[given.held]
        return np.concatenate([by_model.ravel(), by_control])

    start = np.concatenate([np.zeros(3), [model.truth.scale], model.truth.translation, model.ground.ravel()])
    found = least_squares(residuals, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
    assert result.weighted_sum_of_squares == pytest.approx(2 * found.cost, rel=1e-8)
    np.testing.assert_allclose(result.similarity.scale, found.x[3], rtol=1e-8)
    np.testing.assert_allclose(result.adjusted_control, found.x[7:].reshape(-1, 3), atol=1e-6)
    by_control = (given.control - result.adjusted_control)[given.held] / control_sd[given.held]
    total = np.sum(by_control**2) + np.sum((result.model_residuals / model_sd) ** 2)
    assert total == pytest.approx(result.weighted_sum_of_squares, rel=1e-9)


@pytest.mark.parametrize("phi", [-0.3, 1.5])
def test_partials_agree_with_complex_steps(phi):
    """Those of the parameters by the tangent ones, and of a point (by covariances of rank one)."""
    generator = np.random.default_rng(6)
    truth = simulate(generator, angles=(0.4, phi, -2.0)).truth
    centre, model_centre = np.array([300.0, -200.0, 50.0]), np.array([20.0, 10.0, 5.0])
    similarity = Similarity.from_parameters(
        truth.scale, truth.rotation, truth.translation, control_centre=centre, model_centre=model_centre
    )
    point = np.array([31.0, -22.0, 7.0])

    def by_formula(tangent):
        x, y, z = tangent[:3]
        # exp(-[r]x) to the first order is all that a complex step sees.
        a = (np.eye(3) - np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])) @ similarity.rotation
        scale, shift = similarity.scale + tangent[3], similarity.shift + tangent[4:]
        angles = [
            complex_atan2(-a[2, 1], a[2, 2]),
            complex_atan2(a[2, 0], np.sqrt(a[2, 1] ** 2 + a[2, 2] ** 2)),
            complex_atan2(-a[1, 0], a[0, 0]),
        ]
        translation = shift + model_centre - scale * a @ centre
        ground = centre + a.T @ (point - model_centre - shift) / scale
        return np.concatenate([angles, [scale], translation]), ground

    step = 1e-30
    columns = [by_formula(1j * step * np.eye(7)[k]) for k in range(7)]
    parameters = np.column_stack([column[0].imag / step for column in columns])
    np.testing.assert_allclose(similarity.parameter_partials, parameters, rtol=1e-10, atol=1e-10)
    for k, (_, ground) in enumerate(columns):
        unit = np.zeros((7, 7))
        unit[k, k] = 1
        with_unit = Similarity(
            similarity.scale, similarity.rotation, centre, model_centre, similarity.shift, unit
        )
        covariance = with_unit.transform(point[np.newaxis])[1][0]
        partial = ground.imag / step
        np.testing.assert_allclose(
            covariance, np.outer(partial, partial), rtol=1e-10, atol=1e-12 * partial @ partial
        )


def complex_atan2(y, x):
    """Return the argument of x + i y for values with small imaginary parts."""
    angle = np.arctan2(y.real, x.real)
    return angle + 1j * (x.real * y.imag - y.real * x.imag) / (x.real**2 + y.real**2)


def test_the_covariance_of_points_is_regular_at_gimbal_lock():
    """Omega and kappa lose theirs at phi = 90 degrees; a point has that of the renamed axes."""
    generator = np.random.default_rng(14)
    error = NOISE * generator.standard_normal((len(MIXED), 3))
    locked = simulate(generator, angles=(0.3, np.pi / 2, 0.4))
    result = orient(locked.stations(model_error=error))
    cycled = np.roll(np.eye(3), 1, axis=0)
    other = Stations(result.stations.ids, result.stations.control, result.stations.model @ cycled.T)
    renamed = orient(other)
    assert np.abs(renamed.similarity.angles[1]) < 1.2
    here = result.similarity.transform(locked.exact)[1]
    there = renamed.similarity.transform(locked.exact @ cycled.T)[1]
    np.testing.assert_allclose(here, there, rtol=1e-6, atol=1e-9 * here.max())
