"""Control by single coordinates, exact coordinates, and covariances whose unit weight is estimated."""

import numpy as np
import pytest
from orientation_models import MIXED, simulate
from scipy import stats
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from photogram import RankError, orient
from photogram.absolute_orientation import Stations, read_cards, read_csv

NOISE = 0.004
SINGLES = ("XZ", "Y", "X", "YZ", "Z", "XYZ", "X", "Z", "Y")


def independent(given, weights, start):
    """Minimise the weighted sum of u^2 over the known components by scipy."""

    def residuals(unknowns):
        rotation = Rotation.from_rotvec(unknowns[:3]).as_matrix() @ start.rotation
        turned = (given.model - unknowns[4:] - start.translation) @ rotation
        return ((unknowns[3] * given.control - turned) * weights(unknowns[3]))[given.given]

    first = np.array([0.0, 0, 0, start.scale, 0, 0, 0])
    found = least_squares(residuals, first, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
    return Rotation.from_rotvec(found.x[:3]).as_matrix() @ start.rotation, found.x[3], 2 * found.cost


# Each horizontal coordinate by itself


def test_each_horizontal_coordinate_counts_by_itself():
    generator = np.random.default_rng(41)
    model = simulate(generator, SINGLES, angles=(0.1, -0.05, 2.0))
    given = model.stations(model_error=NOISE * generator.standard_normal((9, 3)))
    result = orient(given)
    assert result.known == sum(map(len, SINGLES))
    np.testing.assert_array_equal(result.used, model.known)
    rotation, scale, squares = independent(given, lambda s: 1.0, model.truth)
    np.testing.assert_allclose(result.similarity.rotation, rotation, atol=1e-8)
    assert result.similarity.scale == pytest.approx(scale, rel=1e-8)
    assert result.weighted_sum_of_squares == pytest.approx(squares, rel=1e-8)
    assert np.nansum(result.redundancy) == pytest.approx(result.degrees_of_freedom)
    assert "known coordinates                   13 (4 X, 4 Y, 5 Z)\n" in result.report()
    assert len(result.plot().panels[0].marks) == 6
    report = orient(given, method="report", former=result)
    np.testing.assert_allclose(report.similarity.rotation, rotation, atol=1e-7)


def test_four_single_coordinates_do_for_two_pairs(tmp_path):
    generator = np.random.default_rng(8)
    model = simulate(generator, ("X", "Y", "X", "Y", "Z", "Z", "Z"), angles=(0.02, -0.05, 0.7))
    given = model.stations()
    result = orient(given)
    rotations = [result.similarity.rotation, *(other.rotation for other in result.alternatives)]
    assert min(np.abs(rotation - model.truth.rotation).max() for rotation in rotations) < 1e-8
    rows = [
        ",".join([name, *("" if np.isnan(v) else repr(float(v)) for v in c), *(repr(float(v)) for v in m)])
        for name, c, m in zip(given.ids, given.control, given.model, strict=True)
    ]
    (tmp_path / "a.csv").write_text("\n".join(["id,X,Y,Z,x,y,z", *rows]) + "\n")
    np.testing.assert_array_equal(read_csv(tmp_path / "a.csv").control, given.control)
    cards = [
        " ".join([*("-" if np.isnan(v) else repr(float(v)) for v in c), *(repr(float(v)) for v in m), name])
        for name, c, m in zip(given.ids, given.control, given.model, strict=True)
    ]
    (tmp_path / "a.cards").write_text("\n".join(["0 0 0 0 0 0 0 1", "7 3 0 1", *cards]) + "\n")
    np.testing.assert_array_equal(read_cards(tmp_path / "a.cards").stations.control, given.control)


@pytest.mark.parametrize(
    ("kinds", "counts"),
    [
        (("X", "X", "X", "X", "Z", "Z", "Z"), {"x": 4, "y": 0, "z": 3, "horizontal": 4, "all": 7}),
        (("X", "Y", "X", "Z", "Z", "Z", "Z"), {"x": 2, "y": 1, "z": 4, "horizontal": 4, "all": 7}),
        (("XY", "XY", "XY", "Z", "Z"), {"x": 3, "y": 3, "z": 2, "horizontal": 4, "all": 7}),
    ],
)
def test_too_few_of_a_kind(kinds, counts):
    model = simulate(np.random.default_rng(8), kinds, angles=(0.02, -0.05, 0.7))
    with pytest.raises(RankError) as caught:
        orient(model.stations())
    assert (caught.value.code, caught.value.phrase.fields) == ("orientation.insufficient", counts)


# Exact coordinates


@pytest.mark.parametrize("model_sd", [0.0, 1e-300, 1e-12, 1e-9])
def test_a_model_without_errors(model_sd):
    """All errors are those of the control: sum ((X - X(x)) / sd)^2 is least."""
    generator = np.random.default_rng(9)
    model = simulate(generator, angles=(0.1, -0.05, 2.0))
    control_sd = generator.uniform(0.01, 0.05, (8, 3))
    given = model.stations(
        control_sd * generator.standard_normal((8, 3)), control_sd=control_sd, model_sd=model_sd
    )
    result = orient(given)
    assert result.converged
    rotation, scale, squares = independent(given, lambda s: 1 / (s * control_sd), model.truth)
    np.testing.assert_allclose(result.similarity.rotation, rotation, atol=1e-9)
    assert result.similarity.scale == pytest.approx(scale, rel=1e-9)
    assert result.weighted_sum_of_squares == pytest.approx(squares, rel=1e-6)
    assert np.nansum(result.redundancy) == pytest.approx(result.degrees_of_freedom, abs=1e-6)


@pytest.mark.parametrize("unit", [1e-15, 1e-9, 1e6])
def test_the_unit_of_the_standard_deviations_does_not_matter(unit):
    generator = np.random.default_rng(9)
    model = simulate(generator, angles=(0.1, -0.05, 2.0))
    errors = NOISE * generator.standard_normal((8, 3))
    first = orient(model.stations(model_error=errors, model_sd=1.0, control_sd=2.0))
    second = orient(model.stations(model_error=errors, model_sd=unit, control_sd=2.0 * unit))
    np.testing.assert_allclose(second.similarity.rotation, first.similarity.rotation, atol=1e-9)
    np.testing.assert_allclose(second.studentized, first.studentized, rtol=1e-5)
    covariance = first.similarity.tangent_covariance
    np.testing.assert_allclose(
        second.similarity.tangent_covariance, covariance, rtol=1e-5, atol=1e-9 * covariance.max()
    )


# Unit weight


@pytest.mark.parametrize("factor", [0.6, 1.47])
def test_covariances_of_points_hold_where_all_standard_deviations_are_wrong_by_a_factor(factor):
    """With sigma0 estimated, e^T C^-1 e / 3 is F(3, f), the errors of the points themselves included."""
    generator = np.random.default_rng(1847)
    model = simulate(generator, angles=(0.1, -0.05, 2.0))
    shape = (len(MIXED), 3)
    control_sd = generator.uniform(0.005, 0.02, shape)
    point, point_sd = model.truth.to_model([[300.0, 100.0, 40.0]]), np.array([0.004, 0.006, 0.01])
    quotients = []
    for _ in range(1000):
        result = orient(
            model.stations(
                factor * control_sd * generator.standard_normal(shape),
                factor * NOISE * generator.standard_normal(shape),
                control_sd=control_sd,
                model_sd=NOISE,
            )
        )
        measured = point + factor * point_sd * generator.standard_normal(3)
        position, covariance = result.similarity.transform(measured, point_sd)
        error = position[0] - [300.0, 100.0, 40.0]
        quotients.append(error @ np.linalg.solve(covariance[0], error) / 3)
    expected = stats.f(3, result.degrees_of_freedom)
    assert stats.kstest(quotients, expected.cdf).pvalue > 1e-3


def test_the_factor_of_deviations_goes_with_the_document(tmp_path):
    from photogram.absolute_orientation import read_similarity

    generator = np.random.default_rng(2)
    model = simulate(generator, angles=(0.1, -0.05, 2.0))
    errors = 3 * NOISE * generator.standard_normal((8, 3))
    given = model.stations(model_error=errors, model_sd=NOISE)
    for how in ("estimated", "unity"):
        result = orient(given, unit_variance=how)
        factor = result.sigma0 if how == "estimated" else 1.0
        assert result.similarity.deviation_factor == pytest.approx(factor)
        (tmp_path / "result.json").write_bytes(result.to_json())
        again = read_similarity(tmp_path / "result.json")
        here, there = (each.transform(given.model, NOISE)[1] for each in (result.similarity, again))
        np.testing.assert_allclose(there, here, rtol=1e-6, atol=1e-9 * here.max())
    unweighted = orient(model.stations(model_error=errors))
    assert unweighted.similarity.deviation_factor == 1
    exact = Stations(given.ids, given.control, given.model, model_sd=NOISE)
    assert orient(exact).similarity.deviation_factor > 2
