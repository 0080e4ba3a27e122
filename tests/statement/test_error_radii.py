"""Linear, circular and spherical errors: tables, properties, and errors that were drawn."""

import math
import time

import numpy as np
import pytest
from golden_statement import cofactors, differences, golden
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from photogram import InputError
from photogram.statistics import (
    circular_error,
    linear_error,
    mixture_circular,
    mixture_linear,
    sample_radius,
    spherical_error,
    upper_order,
)


def turned(sds, angle):
    """Return the covariance of standard deviations along axes that are turned."""
    c, s = math.cos(angle), math.sin(angle)
    axes = np.array([[c, -s], [s, c]])
    return axes @ np.diag(np.square(sds)) @ axes.T


@pytest.mark.parametrize("p", [0.3935, 0.5, 0.9, 0.95, 0.99])
def test_circles_of_ellipses_have_the_radii_of_the_table(p):
    rows = golden("circles.json")["ellipses"]
    covariances = [np.diag([1.0, row["ratio"] ** 2]) for row in rows]
    assert circular_error(covariances, p) == pytest.approx([row[str(p)] for row in rows], rel=1e-8)


def test_an_offset_widens_the_circle_as_in_the_table():
    rows = golden("circles.json")["offset"]
    for p, key in ((0.90, "ce90"), (0.95, "ce95")):
        found = circular_error([row["covariance"] for row in rows], p, [row["mean"] for row in rows])
        assert found == pytest.approx([row[key] for row in rows], rel=1e-8)


def test_spheres_have_the_radii_of_the_table():
    rows = golden("circles.json")["spheres"]
    for p, key in ((0.90, "se90"), (0.50, "se50")):
        found = spherical_error([row["covariance"] for row in rows], p)
        assert found == pytest.approx([row[key] for row in rows], rel=1e-7)


def test_order_statistics_are_those_of_the_table():
    for row in golden("circles.json")["order"]:
        order, value = sample_radius(-np.arange(row["n"], 0.0, -1), row["p"])
        assert (order, value) == (row["order"], row["order"])
        assert upper_order(row["n"], row["p"]) == row["upper_95"]


@pytest.mark.parametrize("which", ["statement_unity", "statement_free"])
def test_figures_of_check_points_are_those_of_the_golden_statement(which):
    figures = golden("statement.json")[which]["circular_linear"]
    d = differences()
    radial, heights = np.hypot(d[:, 0], d[:, 1]), d[:, 2]
    for p, name in ((0.90, "90"), (0.95, "95")):
        for values, key in ((radial, f"ce{name}"), (heights, f"le{name}")):
            order, value = sample_radius(values, p)
            assert order == figures[key]["order"]
            assert value == pytest.approx(figures[key]["sample"], rel=1e-6)
            upper = upper_order(len(values), p)
            assert upper == figures[key]["upper_order"]
            if upper is not None:
                assert np.sort(np.abs(values))[upper - 1] == pytest.approx(figures[key]["upper"], rel=1e-6)
        moments = d.T @ d / len(d)
        of = figures["from_moments"]
        assert circular_error([moments[:2, :2]], p)[0] == pytest.approx(of[f"ce{name}"], rel=1e-6)
        assert linear_error([math.sqrt(moments[2, 2])], p)[0] == pytest.approx(of[f"le{name}"], rel=1e-6)


@pytest.mark.parametrize("which", ["statement_unity", "statement_free"])
def test_predicted_radii_are_those_of_the_golden_statement(which):
    s2 = golden("statement.json")["adjustment"]["variance_of_unit_weight"] if "free" in which else 1.0
    own = s2 * np.array([cofactors()[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(30)])
    figures = golden("statement.json")[which]["circular_linear"]["predicted_mixture"]
    assert mixture_circular(own[:, :2, :2], 0.9) == pytest.approx(figures["ce90"], rel=1e-6)
    assert mixture_linear(np.sqrt(own[:, 2, 2]), 0.9) == pytest.approx(figures["le90"], rel=1e-6)
    if which == "statement_unity":
        rows = golden("statement.json")[which]["points"]
        ce90 = circular_error(own[:, :2, :2], 0.9)
        assert ce90 == pytest.approx([row["ce90_predicted"] for row in rows], rel=1e-6)
        le90 = linear_error(np.sqrt(own[:, 2, 2]), 0.9)
        assert le90 == pytest.approx([row["le90_predicted"] for row in rows], rel=1e-6)


SDS = st.floats(1e-4, 1e3)
RATIOS = st.floats(0.0, 1.0)
PROBABILITIES = st.floats(0.01, 0.999)
ANGLES = st.floats(-math.pi, math.pi)


@given(SDS, PROBABILITIES, ANGLES)
def test_a_circle_of_equal_axes_is_that_of_the_closed_formula(sd, p, angle):
    expected = sd * math.sqrt(-2 * math.log1p(-p))
    assert circular_error([turned((sd, sd), angle)], p)[0] == pytest.approx(expected, rel=1e-9)


@given(SDS, PROBABILITIES, ANGLES)
def test_a_circle_of_an_axis_without_error_is_the_linear_error(sd, p, angle):
    found = circular_error([turned((sd, 0.0), angle)], p)[0]
    assert found == pytest.approx(linear_error([sd], p)[0], rel=1e-8)


@given(SDS, RATIOS, PROBABILITIES, ANGLES, ANGLES, st.floats(0.0, 10.0))
def test_a_radius_does_not_turn_with_the_axes(sd, ratio, p, angle, direction, offset):
    mean = sd * offset * np.array([math.cos(direction), math.sin(direction)])
    c, s = math.cos(angle), math.sin(angle)
    straight = circular_error([np.diag([sd**2, (ratio * sd) ** 2])], p, [mean])[0]
    rotated = circular_error([turned((sd, ratio * sd), angle)], p, [np.array([[c, -s], [s, c]]) @ mean])[0]
    assert rotated == pytest.approx(straight, rel=1e-7)


@given(RATIOS, PROBABILITIES, PROBABILITIES, st.floats(0.0, 30.0))
def test_a_radius_grows_with_the_probability_and_the_ratio(ratio, p, q, offset):
    narrow, wide = np.diag([1.0, ratio**2]), np.eye(2)
    low, high = (circular_error([narrow], each, [[offset, 0.0]])[0] for each in sorted((p, q)))
    assert low <= high * (1 + 1e-9)
    assert circular_error([narrow], p)[0] <= circular_error([wide], p)[0] * (1 + 1e-9)


@given(st.floats(1e-6, 1e6), RATIOS, PROBABILITIES)
def test_radii_have_the_unit_of_the_standard_deviations(scale, ratio, p):
    flat, solid = np.diag([1.0, ratio**2]), np.diag([1.0, ratio**2, ratio**4])
    for function, matrix in ((circular_error, flat), (spherical_error, solid)):
        expected = scale * function([matrix], p)[0]
        assert function([scale**2 * matrix], p)[0] == pytest.approx(expected, rel=1e-9)


@settings(max_examples=25)
@given(RATIOS, st.floats(0.05, 0.99), st.floats(0.0, 50.0), ANGLES)
def test_a_circle_with_an_offset_holds_its_probability(ratio, p, offset, direction):
    """Against the noncentral distribution where axes are equal, and quadratures of another kind where not."""
    mean = np.array([math.cos(direction), math.sin(direction)]) * offset
    round_ = circular_error([np.eye(2)], p, [mean])[0]
    assert stats.ncx2.cdf(round_**2, 2, offset**2) == pytest.approx(p, abs=1e-8)
    b = max(ratio, 0.05)
    radius = circular_error([np.diag([1.0, b**2])], p, [mean])[0]
    t = np.linspace(-math.pi / 2, math.pi / 2, 200_001)
    x, w = radius * np.sin(t), radius * np.cos(t)
    inner = stats.norm.cdf((w - mean[1]) / b) - stats.norm.cdf((-w - mean[1]) / b)
    assert np.trapezoid(stats.norm.pdf(x, mean[0]) * inner * w, t) == pytest.approx(p, abs=1e-8)


@given(st.floats(0.05, 0.99))
def test_spheres_of_special_axes_are_known(p):
    found = spherical_error([np.eye(3), np.diag([1.0, 1.0, 0.0]), np.diag([0.0, 1.0, 0.0])], p)
    expected = [math.sqrt(stats.chi2.ppf(p, dof)) for dof in (3, 2, 1)]
    assert found == pytest.approx(expected, rel=1e-8)


def test_drawn_errors_lie_within_circles_and_spheres_as_often_as_they_should():
    rng = np.random.default_rng(20)
    root = rng.normal(size=(3, 3))
    covariance, mean = root @ root.T, np.array([1.5, -0.7])
    drawn = rng.normal(size=(400_000, 3)) @ root.T
    flat = drawn[:, :2]
    for p in (0.5, 0.9):
        scatter = 4 * math.sqrt(p * (1 - p) / len(drawn))
        plain = circular_error([covariance[:2, :2]], p)[0]
        shifted = circular_error([covariance[:2, :2]], p, [mean])[0]
        sphere = spherical_error([covariance], p)[0]
        assert np.mean(np.linalg.norm(flat, axis=1) < plain) == pytest.approx(p, abs=scatter)
        assert np.mean(np.linalg.norm(flat + mean, axis=1) < shifted) == pytest.approx(p, abs=scatter)
        assert np.mean(np.linalg.norm(drawn, axis=1) < sphere) == pytest.approx(p, abs=scatter)


def test_a_mixture_holds_the_mean_of_the_probabilities():
    sds = np.array([0.0, 0.01, 0.02, 5.0])
    radius = mixture_linear(sds, 0.8)
    assert np.mean([1.0, *(2 * stats.norm.cdf(radius / sds[1:]) - 1)]) == pytest.approx(0.8, abs=1e-10)
    same = turned((3.0, 1.0), 0.3)
    assert mixture_circular([same] * 3, 0.9) == pytest.approx(circular_error([same], 0.9)[0], rel=1e-9)
    assert mixture_circular([same, np.zeros((2, 2))], 0.4) == 0.0
    assert math.isnan(mixture_linear([], 0.9))
    assert math.isnan(mixture_linear([0.1, math.nan], 0.9))


def test_errors_that_are_not_known_have_no_radius_and_those_that_are_none_have_zero():
    matrices = [np.zeros((2, 2)), np.full((2, 2), np.nan), np.eye(2)]
    assert circular_error(matrices, 0.9) == pytest.approx([0.0, math.nan, 2.14596602629], nan_ok=True)
    offsets = [[3.0, 4.0], [0.0, 0.0], [math.nan, 0.0]]
    assert circular_error(matrices, 0.9, offsets) == pytest.approx([5.0, math.nan, math.nan], nan_ok=True)
    assert circular_error(np.zeros((0, 2, 2)), 0.9).shape == (0,)


def test_the_bound_of_a_quantile_is_the_first_that_has_the_confidence():
    for n in (1, 45, 59, 300):
        for p in (0.5, 0.9, 0.95):
            enough = [k for k in range(1, n + 1) if stats.binom.cdf(k - 1, n, p) >= 0.95]
            assert upper_order(n, p) == (enough[0] if enough else None)
    assert upper_order(0, 0.9) is None
    assert upper_order(100_000, 0.9) == pytest.approx(stats.binom.ppf(0.95, 100_000, 0.9) + 1)


def test_a_share_is_not_rounded_up_by_a_rounding_error():
    assert sample_radius(np.arange(1.0, 101.0), 0.07) == (7, 7.0)


@pytest.mark.parametrize(
    ("call", "name", "code"),
    [
        (lambda: linear_error([1.0], 1.0), "probability", "error.range"),
        (lambda: linear_error([0.1, -0.1], 0.9), "sd[1]", "error.not-negative"),
        (lambda: linear_error([[0.1]], 0.9), "sd", "error.shape"),
        (lambda: circular_error(np.eye(2), 0.9), "covariances", "error.shape"),
        (lambda: circular_error([np.eye(2)], 0.9, [0.0, 0.0]), "offsets", "error.shape"),
        (
            lambda: circular_error([np.eye(2), np.diag([1.0, -1.0])], 0.9),
            "covariances[1]",
            "error.covariance-singular",
        ),
        (
            lambda: spherical_error([np.eye(3) + np.eye(3, k=1)], 0.9),
            "covariances[0]",
            "error.covariance-singular",
        ),
        (lambda: sample_radius([], 0.9), "values", "error.kind"),
        (lambda: sample_radius([1.0, math.nan], 0.9), "values", "error.kind"),
        (lambda: upper_order(-1, 0.9), "count", "error.not-negative"),
    ],
)
def test_what_is_no_covariance_or_probability_is_refused(call, name, code):
    with pytest.raises(InputError) as caught:
        call()
    fields = caught.value.phrase.fields
    assert (str(fields.get("what", "")), getattr(fields.get("message"), "code", caught.value.code)) == (
        name,
        code,
    )


def test_standard_deviations_are_numbers():
    with pytest.raises(InputError, match="sd"):
        linear_error(["a"], 0.9)


@pytest.mark.speed
def test_a_thousand_points_take_well_under_half_a_second():
    roots = np.random.default_rng(3).normal(size=(1000, 3, 3))
    covariances = roots @ np.swapaxes(roots, 1, 2)
    start = time.perf_counter()
    circular_error(covariances[:, :2, :2], 0.9)
    circular_error(covariances[:, :2, :2], 0.9, np.ones((1000, 2)))
    mixture_circular(covariances[:, :2, :2], 0.9)
    assert time.perf_counter() - start < 0.25
    spherical_error(covariances, 0.9)
    assert time.perf_counter() - start < 0.75
