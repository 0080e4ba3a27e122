"""Global tests and limits of residuals against published and computed critical values."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from photogram import _photocore
from photogram.statistics import externally_studentized, global_test, normal_limit, studentized_limit

CRITICAL = Path(__file__).parent / "data" / "statistics" / "critical_values.json"
"""Computed by independent programs; some stand in every table of the distributions."""


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
