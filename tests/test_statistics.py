"""Global tests and limits of residuals against published and computed critical values."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from photogram import InputError, _photocore
from photogram.statistics import (
    b_method,
    benjamini_hochberg,
    bonferroni,
    critical_chi_square,
    critical_fisher,
    critical_normal,
    critical_student,
    critical_tau,
    externally_studentized,
    global_test,
    lambda0,
    log_chi_square,
    log_fisher,
    normal_limit,
    studentized_limit,
)

CRITICAL = Path(__file__).parent / "data" / "statistics" / "critical_values.json"
"""Computed by independent programs; some stand in every table of the distributions."""

PUBLISHED = Path(__file__).parent / "data" / "statistics" / "published_problems.json"
"""Problems of texts, with their printed answers and what independent programs computed."""


@pytest.fixture(scope="module")
def critical():
    return json.loads(CRITICAL.read_text())


def test_chi_square_limits(critical):
    for row in critical["chi2"]:
        for side in ("upper", "lower"):
            for level, value in row[side].items():
                found = _photocore.chi_square_quantile(float(level), row["dof"], upper=side == "upper")
                assert found == pytest.approx(value, rel=1e-9)


def test_global_limits(critical):
    for row in critical["global_two_sided"]:
        test = global_test(row["dof"], row["dof"], row["alpha"])
        assert test.limits == pytest.approx((row["low_ratio"], row["high_ratio"]), rel=1e-9)


def test_fisher_limits(critical):
    for row in critical["f_upper"]:
        found = _photocore.fisher_limit(row["alpha"], row["dof1"], row["dof2"])
        assert found == pytest.approx(row["value"], rel=1e-9)


def test_student_limits_are_those_of_tau(critical):
    for row in critical["tau_two_sided"]:
        t = _photocore.student_limit(row["alpha"], row["dof"] - 1)
        assert t == pytest.approx(row["t_of_dof_minus_1"], rel=1e-9)
        # Pope's tau is the w that reaches this t when Omega = f; its own digits are lost near the root of f.
        f = row["dof"]
        tau = math.sqrt(f) * t / math.hypot(math.sqrt(f - 1), t)
        assert tau == pytest.approx(row["value"], rel=1e-9)
        assert externally_studentized(tau, f, f) == pytest.approx(t, rel=1e-7)


def test_bonferroni(critical):
    for row in critical["tau_bonferroni"]:
        limit = studentized_limit(row["dof"], row["tests"], row["family_alpha"])
        assert limit == pytest.approx(row["t_of_dof_minus_1"], rel=1e-9)
        assert normal_limit(row["tests"], row["family_alpha"]) == pytest.approx(row["normal"], rel=1e-9)


def test_normal_limits(critical):
    for row in critical["normal_two_sided"]:
        assert critical_normal(row["alpha"]) == pytest.approx(row["value"], rel=1e-9)


def test_tau_limits(critical):
    for row in critical["tau_two_sided"]:
        assert critical_tau(row["alpha"], row["dof"]) == pytest.approx(row["value"], rel=1e-9)
    for row in critical["tau_bonferroni"]:
        level = bonferroni(row["family_alpha"], row["tests"])
        assert level == pytest.approx(row["per_test_alpha"], rel=1e-9)
        assert critical_tau(level, row["dof"]) == pytest.approx(row["value"], rel=1e-9)
        assert critical_tau(level, row["dof"]) < math.sqrt(row["dof"]) * (1 + 1e-15)


def test_lambda0(critical):
    for row in critical["lambda0"]:
        found = lambda0(row["alpha0"], row["power"], row["dimension"])
        assert found == pytest.approx(row["lambda0"], rel=1e-9)


def test_lambda0_of_unknown_unit_weight(critical):
    for row in critical["lambda0_F"]:
        second = row["dof"] - row["dimension"]
        assert critical_fisher(row["alpha0"], row["dimension"], second) == pytest.approx(
            row["critical_F"], rel=1e-9
        )
        found = lambda0(row["alpha0"], row["power"], row["dimension"], row["dof"])
        # Printed with eight digits.
        assert found == pytest.approx(row["lambda0"], rel=5e-8)


def test_b_method(critical):
    for row in critical["b_method"]:
        level, limit = b_method(row["dimension"], row["alpha0"], row["power"])
        assert level == pytest.approx(row["alpha"], rel=1e-9)
        assert limit == pytest.approx(row["critical_chi2"], rel=1e-9)
    # Of the six-photo block: 0.355.
    assert b_method(81)[0] == pytest.approx(0.355, abs=5e-4)


def test_benjamini_and_hochberg():
    """The example of their paper: four of fifteen are rejected, by Bonferroni three."""
    problem = json.loads(PUBLISHED.read_text())["benjamini_hochberg"]
    p, level = np.array(problem["p"]), problem["level"]
    shuffled = np.random.default_rng(3).permutation(len(p))
    rejected = benjamini_hochberg(p[shuffled], level)
    assert rejected.sum() == 4
    assert set(p[shuffled][rejected]) == set(np.sort(p)[:4])
    assert (p <= bonferroni(level, len(p))).sum() == 3
    assert benjamini_hochberg(p, level, dependent=True).sum() == 3
    assert benjamini_hochberg([*p, math.nan], level).tolist() == [*benjamini_hochberg(p, level), False]
    assert not benjamini_hochberg([], level).size
    assert not benjamini_hochberg([0.5, 0.9], level).any()


def test_logarithms_of_tiny_probabilities():
    """Of two degrees of freedom: exp(-x / 2), and (1 + 2 x / f)^(-f / 2)."""
    x = np.array([[0.0, 5.0], [2e3, 1e6]])
    assert log_chi_square(x, 2) == pytest.approx(-x / 2)
    assert log_fisher(x, 2, 800) == pytest.approx(-400 * np.log1p(x / 400))
    assert log_chi_square([4.0, 1500.0], [1.0, 3.0]).tolist() == sorted(
        log_chi_square([4.0, 1500.0], [1.0, 3.0]), reverse=True
    )
    # Large ones of one degree of freedom: the asymptotic series of the normal tail, to its third term.
    w = 60.0
    tail = -(w**2) / 2 - math.log(w * math.sqrt(math.pi / 2)) + math.log1p(-(w**-2) + 3 * w**-4)
    assert log_chi_square(w**2, 1) == pytest.approx(tail, rel=1e-11)
    assert np.isnan(log_chi_square([math.nan, 1.0], [1.0, 0.0])).all()


def test_without_degrees_of_freedom_nothing_is_tested():
    assert critical_tau(0.05, 1) == math.inf
    assert critical_student(0.05, 0) == math.inf
    assert critical_fisher(0.05, 2, 0) == math.inf
    assert lambda0(dof=1) == math.inf
    assert critical_fisher(0.05, 2, math.inf) == pytest.approx(critical_chi_square(0.05, 2) / 2)
    assert critical_tau(0.05, math.inf) == pytest.approx(critical_normal(0.05))
    for level in (0.0, 1.0, math.nan):
        with pytest.raises(InputError):
            critical_normal(level)
    with pytest.raises(InputError):
        lambda0(0.5, 0.2)


def test_stack_loss():
    """Observation 21 of Brownlee's stack loss data: internally -2.638, externally -3.33 (many texts)."""
    assert externally_studentized(-2.638, 17.0, 17) == pytest.approx(-3.33, abs=0.005)


def test_one_bad_observation_exceeds_any_limit():
    """Internally studentized it would be the root of 8, 2.83, whatever its size."""
    t = externally_studentized([10.0, 0.0], 100.0, 8)
    assert t[0] > studentized_limit(8, 15)
    assert t[1] == 0


def test_global_test_speaks_of_what_matters():
    assert global_test(81.0, 81).problem() is None
    failed = global_test(81 * 35820.0, 81)
    assert failed.rejected_high
    assert "189 times larger" in failed.problem()
    # Significant, but the factor of 1.1 harms nobody.
    assert global_test(1.21e5, 1e5).rejected_high
    assert global_test(1.21e5, 1e5).problem() is None
    assert global_test(40.0, 81).rejected_low
    assert global_test(1.0, 0) is None


def test_sums_that_are_no_numbers_are_rejected():
    assert global_test(math.inf, 5).rejected_high
    assert global_test(math.nan, 5).rejected_high


def test_levels_hold():
    """One in twenty good adjustments is rejected by the global test, and by the largest of their t."""
    rng = np.random.default_rng(12)
    design = rng.normal(size=(12, 4))
    project = np.eye(12) - design @ np.linalg.solve(design.T @ design, design.T)
    root = np.sqrt(np.diag(project))
    trials, rejected, flagged = 4000, 0, 0
    limit = studentized_limit(8, 12)
    for _ in range(trials):
        v = project @ rng.normal(size=12)
        test = global_test(v @ v, 8)
        rejected += test.rejected_high or test.rejected_low
        flagged += np.abs(externally_studentized(v / root, v @ v, 8)).max() > limit
    assert rejected / trials == pytest.approx(0.05, abs=0.012)
    # Bonferroni is an upper bound.
    assert 0.03 < flagged / trials < 0.06
