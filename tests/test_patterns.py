"""Patterns of residuals: each is found where it is, and seldom where it is not."""

import math

import numpy as np
import pytest

from photogram.statistics.patterns import frame_pattern, group_patterns, normality, regression


def projector(rows, columns, seed):
    design = np.random.default_rng(seed).normal(size=(rows, columns))
    return np.eye(rows) - design @ np.linalg.pinv(design)


def test_anderson_and_darling():
    """Critical values of Stephens (1974): 0.631 at 10, 0.752 at 5, 1.035 at 1 percent."""
    rng = np.random.default_rng(4)
    found = [normality(rng.normal(size=100) * 7 + 3) for _ in range(2000)]
    statistics, p = (
        np.array([getattr(each, name) for each in found]) for name in ("statistic", "probability")
    )
    for limit, share in ((0.631, 0.10), (0.752, 0.05), (1.035, 0.01)):
        assert (statistics > limit).mean() == pytest.approx(share, abs=3 * math.sqrt(share / 2000) + 0.004)
        assert p[np.abs(statistics - limit).argmin()] == pytest.approx(share, rel=0.1)
    assert np.mean([each.beyond[0] for each in found]) == pytest.approx(0.0455, abs=0.003)


def test_many_values_are_tested_by_a_sample_with_the_same_level():
    rng = np.random.default_rng(6)
    found = [normality(rng.normal(size=100_000)) for _ in range(100)]
    assert np.mean([each.statistic > 0.631 for each in found]) == pytest.approx(0.10, abs=0.09)
    assert np.mean([each.statistic for each in found]) == pytest.approx(0.385, abs=0.06)


def test_heavy_tails_and_light_ones():
    rng = np.random.default_rng(5)
    heavy = normality(rng.standard_t(3, size=2000))
    assert heavy.probability < 1e-6
    assert heavy.excess > 1
    light = normality(rng.uniform(size=2000))
    assert light.probability < 1e-6
    assert light.excess < -0.7
    assert normality(np.zeros(100)) is None
    assert normality(rng.normal(size=19)) is None
    assert normality(rng.normal(size=100_001)).values <= 20_000


def test_the_frame_without_a_pattern():
    """The size is no more than the level, with residuals of an adjustment."""
    rng = np.random.default_rng(6)
    r = projector(800, 300, 7)
    xy = rng.uniform(-1, 1, size=(400, 2))
    redundancy = np.diag(r).reshape(-1, 2)
    found = [
        frame_pattern(xy, (r @ rng.normal(size=800)).reshape(-1, 2), redundancy).probability
        for _ in range(400)
    ]
    assert np.mean(np.array(found) < 0.05) < 0.09
    assert min(found) > 1e-5


def test_the_frame_with_a_pattern():
    rng = np.random.default_rng(8)
    xy = rng.uniform(-1, 1, size=(1000, 2)) * [120, 80]
    residuals = rng.normal(size=(1000, 2))
    residuals[(xy > [72, 48]).all(axis=1)] += [1.5, 0.0]
    found = frame_pattern(xy, residuals, np.ones_like(xy))
    assert found.probability < 1e-3
    assert found.dof == 50
    assert found.largest[0] == pytest.approx(1.5, abs=0.5)
    assert (np.array(found.at) > [72, 48]).all()
    assert frame_pattern(xy, residuals, np.ones_like(xy), 9).dof == 41
    assert frame_pattern(xy[:30], residuals[:30], np.ones((30, 2))) is None
    assert frame_pattern(xy[:0], xy[:0], xy[:0]) is None


def test_a_photo_with_a_linear_form():
    rng = np.random.default_rng(9)
    groups = np.repeat(np.arange(20), 60)
    xy = rng.uniform(-1, 1, size=(1200, 2)) * 100
    residuals = rng.normal(size=(1200, 2))
    statistics, p = group_patterns(groups, 21, xy, residuals, np.ones_like(xy))
    assert math.isnan(p[20])
    assert np.nanmin(p) > 0.05 / 20
    assert statistics[:20].mean() == pytest.approx(6, abs=2)
    residuals[groups == 7, 0] += 0.02 * xy[groups == 7, 1]
    _, p = group_patterns(groups, 21, xy, residuals, np.ones_like(xy))
    assert np.nanargmin(p) == 7
    assert p[7] < 1e-6
    # Another unit of the coordinates is the same test.
    np.testing.assert_allclose(group_patterns(groups, 21, xy * 1e3, residuals, np.ones_like(xy))[1], p)


def test_a_drift():
    rng = np.random.default_rng(10)
    time = np.linspace(-1, 1, 40)
    design = np.column_stack([np.ones(40), time, time**2])
    values = rng.normal(size=40)
    sizes = [regression(rng.normal(size=40), design).probability for _ in range(1000)]
    assert np.mean(np.array(sizes) < 0.05) == pytest.approx(0.05, abs=0.02)
    found = regression(values + 3 * time, design)
    assert found.probability < 1e-5
    assert found.dof == (3.0, 37.0)
    assert found.rms == pytest.approx(math.sqrt(3), abs=0.6)
    values[5:] = math.nan
    assert regression(values, design) is None
    assert regression(np.ones(40), np.column_stack([design, design[:, 1]])) is None
