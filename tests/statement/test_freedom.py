"""Degrees of freedom, intervals of an RMSE, coverage factors: published figures and golden ones."""

import math

import numpy as np
import pytest
from golden_statement import cofactors, control, golden
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from photogram import InputError
from photogram.statistics import (
    coverage_factor,
    effective_freedom,
    joint_freedom,
    rmse_interval,
    welch_satterthwaite,
)

ROWS = {"e": [0], "n": [1], "h": [2], "plan": [0, 1], "all": [0, 1, 2]}


@pytest.mark.parametrize("component", ROWS)
@pytest.mark.parametrize("which", ["statement_unity", "statement_free"])
def test_effective_degrees_of_freedom_and_intervals_are_the_golden_ones(which, component):
    whole = golden("statement.json")
    s2 = whole["adjustment"]["variance_of_unit_weight"] if "free" in which else 1.0
    joint = s2 * cofactors() + np.diag(control()["check"][2].ravel() ** 2)
    rows = (3 * np.arange(30)[:, np.newaxis] + ROWS[component]).ravel()
    found = effective_freedom(joint[np.ix_(rows, rows)])
    expected = whole[which]["prediction"][component]
    assert found == pytest.approx(expected["effective_dof"], rel=1e-6)
    interval = rmse_interval(expected["found_rmse"], found)
    assert interval == pytest.approx(expected["rmse_interval_95"], rel=1e-6)


def test_the_end_gauge_of_the_gum_has_its_published_figures():
    """JCGM 100:2008, annex H.1.

    16.7 is cut off there, not rounded, and 93 nm follow from rounded figures.
    """
    u, freedom = [25.0, 9.7, 2.9, 16.6], [18, 25.6, 50, 2]
    combined = math.hypot(*u)
    found = welch_satterthwaite(u, freedom)
    assert combined == pytest.approx(32, abs=0.5)
    assert 16.7 <= found < 16.8
    k = coverage_factor(0.99, found)
    assert k == pytest.approx(2.92, abs=0.005)
    assert k * round(combined) == pytest.approx(93, abs=0.5)


def test_figures_of_the_gum_are_those_computed_independently():
    gum = golden("circles.json")["gum"]
    published, computed = gum["published"], gum["computed"]
    found = welch_satterthwaite(published["u_nm"], published["dof"])
    assert found == pytest.approx(computed["effective_dof"], rel=1e-9)
    assert coverage_factor(0.99, found) == pytest.approx(computed["k99"], rel=1e-9)
    plain = coverage_factor(0.99, found, truncated=False)
    assert plain == pytest.approx(computed["k99_not_truncated"], rel=1e-9)
    for row in gum["more"]:
        freedom = [math.inf if each is None else each for each in row["dof"]]
        found = welch_satterthwaite(row["u"], freedom)
        assert found == pytest.approx(row["effective_dof"], rel=1e-9)
        assert coverage_factor(0.95, found) == pytest.approx(row["k95"], rel=1e-9)


@pytest.mark.parametrize("quantity", ["height of C08", "distance C01 C30", "principal distance f"])
def test_degrees_of_freedom_of_budgets_are_the_golden_ones(quantity):
    budgets = golden("statement.json")["budgets"]
    own = budgets["quantities"][quantity]
    expected = own["degrees_of_freedom"]
    estimated = ["images", "control", "gnss"]
    parts = {name: group["contribution"] for name, group in own["by_kind"].items()}
    given_ = sum(part for name, part in parts.items() if name not in estimated)
    found = joint_freedom([parts[name] for name in estimated], budgets["covariance_of_components"], given_)
    assert found == pytest.approx(expected["components_joint"], rel=1e-6)
    k95 = coverage_factor(0.95, found, truncated=False)
    assert k95 == pytest.approx(expected["k95_components_joint"], rel=1e-6)
    freedom = [expected["nu_of_kind"].get(name, math.inf) for name in parts]
    classic = welch_satterthwaite(np.sqrt([*parts.values()]), freedom)
    assert classic == pytest.approx(expected["components_welch_satterthwaite"], rel=1e-6)
    k95 = coverage_factor(0.95, classic, truncated=False)
    assert k95 == pytest.approx(expected["k95_components_welch_satterthwaite"], rel=1e-6)


@given(st.integers(1, 40), st.floats(1e-6, 1e6))
def test_independent_errors_have_as_many_degrees_of_freedom_as_there_are(count, variance):
    assert effective_freedom(variance * np.eye(count)) == pytest.approx(count, rel=1e-12)
    assert effective_freedom(np.full((count, count), variance)) == pytest.approx(1, rel=1e-12)


@given(st.lists(st.floats(0.01, 100), min_size=1, max_size=6), st.data())
def test_components_without_correlation_have_the_degrees_of_freedom_of_welch_and_satterthwaite(u, data):
    nu = data.draw(st.lists(st.floats(1, 1000), min_size=len(u), max_size=len(u)))
    joint = joint_freedom(np.square(u), np.diag(2 / np.array(nu)))
    assert joint == pytest.approx(welch_satterthwaite(u, nu), rel=1e-9)
    assert min(nu) * (1 - 1e-9) <= joint <= sum(nu) * (1 + 1e-9)


def test_intervals_hold_the_expected_error_of_correlated_differences_as_often_as_they_say():
    rng = np.random.default_rng(7)
    # Thirty errors of which each has a third of its variance in common with all others near it.
    place = np.arange(30)
    covariance = np.eye(30) + 0.5 * np.exp(-np.abs(place[:, np.newaxis] - place) / 4)
    drawn = rng.normal(size=(20_000, 30)) @ np.linalg.cholesky(covariance).T
    found = np.sqrt(np.mean(drawn**2, axis=1))
    low, high = rmse_interval(1.0, effective_freedom(covariance))
    expected = math.sqrt(np.trace(covariance) / 30)
    assert np.mean((low * found < expected) & (expected < high * found)) == pytest.approx(0.95, abs=0.01)


def test_what_is_known_has_the_factor_and_the_interval_of_the_normal_distribution():
    assert coverage_factor(0.95, math.inf) == pytest.approx(1.959963984540054, rel=1e-12)
    assert rmse_interval(0.3, math.inf) == (0.3, 0.3)
    assert welch_satterthwaite([1.0, 2.0], [math.inf, math.inf]) == math.inf
    assert joint_freedom([], np.zeros((0, 0)), 3.0) == math.inf
    assert math.isnan(effective_freedom(np.zeros((3, 3))))
    assert math.isnan(effective_freedom([[math.nan]]))
    assert all(math.isnan(each) for each in rmse_interval(0.1, math.nan))


def test_degrees_of_freedom_are_truncated_to_whole_numbers():
    assert coverage_factor(0.95, 16.9) == pytest.approx(stats.t.ppf(0.975, 16), rel=1e-9)
    assert coverage_factor(0.95, 17 - 1e-12) == pytest.approx(stats.t.ppf(0.975, 17), rel=1e-9)
    assert coverage_factor(0.95, 0.7) == math.inf
    assert coverage_factor(0.95, 0.7, truncated=False) == pytest.approx(stats.t.ppf(0.975, 0.7), rel=1e-9)


@pytest.mark.parametrize(
    ("call", "name", "code"),
    [
        (lambda: effective_freedom([1.0, 2.0]), "covariance", "error.shape"),
        (lambda: effective_freedom([[1.0, 0.5], [0.0, 1.0]]), "", "error.covariance-singular"),
        (lambda: effective_freedom([[2.0, 0.0], [0.0, -1.0]]), "", "error.covariance-singular"),
        (lambda: rmse_interval(-1.0, 3), "rmse", "error.not-negative"),
        (lambda: rmse_interval(1.0, 0), "freedom", "error.positive"),
        (lambda: rmse_interval(1.0, 3, 1.5), "level", "error.range"),
        (lambda: welch_satterthwaite([1.0, -1.0], [1, 1]), "u[1]", "error.not-negative"),
        (lambda: welch_satterthwaite([1.0], [0]), "freedom[0]", "error.positive"),
        (lambda: welch_satterthwaite([1.0], [1, 2]), "freedom", "error.shape"),
        (lambda: joint_freedom([1.0], np.eye(2)), "covariance_of_components", "error.shape"),
        (lambda: joint_freedom([1.0], [[-1.0]]), "", "error.covariance-singular"),
        (lambda: joint_freedom([1.0], [[1.0]], -1), "given", "error.not-negative"),
        (lambda: joint_freedom([[1.0]], [[1.0]]), "contributions", "error.shape"),
        (lambda: coverage_factor(95, 3), "probability", "error.range"),
        (lambda: coverage_factor(0.95, -3), "freedom", "error.positive"),
    ],
)
def test_what_is_no_variance_or_number_of_degrees_is_refused(call, name, code):
    with pytest.raises(InputError) as caught:
        call()
    fields = caught.value.phrase.fields
    assert (str(fields.get("what", "")), getattr(fields.get("message"), "code", caught.value.code)) == (
        name,
        code,
    )
