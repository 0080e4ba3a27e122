"""Values with covariances on several occasions: what changes is named, what does not is left in peace."""

import math

import numpy as np
import pytest

from photogram import InputError
from photogram.history.changes import history

YEARS = np.array([0.0, 0.2, 0.5, 0.6, 1.1, 1.3, 1.9, 2.4])
C = np.array([[4.0, 1.5], [1.5, 1.0]])


def series(seed, *, common=0.0, **options):
    """Return eight occasions of two correlated values, with an error that all have in common."""
    rng = np.random.default_rng(seed)
    errors = rng.multivariate_normal([0, 0], C, len(YEARS)) + common * rng.standard_normal(2)
    covariance = np.zeros((8, 2, 8, 2))
    covariance[np.arange(8), :, np.arange(8), :] = C
    covariance += common**2 * np.eye(2)[np.newaxis, :, np.newaxis, :]
    values = errors + options.pop("signal", 0.0)
    settings = {"names": ["scale", "angle"], "units": ["um/m", "arc seconds"], "unit_of_time": "year"}
    return history(values, covariance, times=YEARS, **settings, **options)


def test_nothing_is_found_where_nothing_changes():
    """Five percent of the histories have a finding, whatever the occasions have in common."""
    for common in (0.0, 5.0):
        found = [series(seed, common=common) for seed in range(300)]
        assert 0.005 < np.mean([bool(each.sentences) for each in found]) < 0.08
        assert 0.02 < np.mean([each.constancy.probability_above < 0.05 for each in found]) < 0.09


def test_a_drift_is_named_with_its_size():
    signal = np.outer(YEARS, [6.0, 0.0])
    found = [series(seed, signal=signal) for seed in range(60)]
    kinds = [[change.kind for change in each.series[0].changes] for each in found]
    assert kinds.count(["drift"]) > 40
    assert sum(bool(each.series[1].changes) for each in found) < 6
    sizes = [(each.series[0].drift - 6) / each.series[0].drift_sd for each in found]
    assert np.std(sizes) == pytest.approx(1.0, abs=0.25)
    assert "drifts by" in found[0].sentences[0]
    assert "um/m a year" in found[0].sentences[0]


def test_a_step_is_found_where_it_was():
    signal = np.outer(YEARS > 1.0, [20.0, 0.0])
    found = series(7, signal=signal, occasions=[f"day {k}" for k in range(8)])
    (change,) = found.series[0].changes
    assert (change.kind, change.at) == ("step", 4)
    assert abs(change.size - 20) < 4 * change.sd
    assert "steps by" in found.sentences[0]
    assert "between day 3 and day 4" in found.sentences[0]
    assert found.constancy.rejected_high
    before, after = found.series[0].model[[3, 4]]
    assert after - before == pytest.approx(change.size)


def test_a_single_occasion_and_another_cause_are_told_apart():
    signal = np.zeros((8, 2))
    signal[3, 1] = 9.0
    assert [(each.kind, each.at) for each in series(4, signal=signal).series[1].changes] == [("single", 3)]
    temperature = np.array([20.0, 23.0, 21.0, 25.0, 20.5, 24.0, 19.0, 22.0])
    warm = series(
        3, signal=np.outer(temperature, [5.0, 0.0]), regressors={"temperature": (temperature, "kelvin")}
    )
    (change,) = warm.series[0].changes
    assert change.kind == "temperature"
    assert abs(change.size - 5) < 4 * change.sd
    assert "scale changes with the temperature by" in warm.sentences[0]


def test_figures_are_those_of_a_dense_computation():
    found = series(11, common=2.0).series[0]
    c = np.diag(np.full(8, 4.0)) + 4.0
    weight = np.linalg.inv(c)
    a = np.column_stack([np.ones(8), YEARS])
    cofactors = np.linalg.inv(a.T @ weight @ a)
    drift = (cofactors @ a.T @ weight @ found.values)[1]
    assert (found.drift, found.drift_sd) == pytest.approx((drift, math.sqrt(cofactors[1, 1])))
    others = np.delete(np.arange(8), 2)
    inner = np.linalg.inv(c[np.ix_(others, others)])
    # What the others say of the value, whose error is partly theirs: the best prediction.
    mean = inner.sum(axis=0) @ found.values[others] / inner.sum()
    predicted = mean + c[2, others] @ inner @ (found.values[others] - mean)
    assert found.off[2] == pytest.approx(found.values[2] - predicted)


def test_what_is_no_history_is_refused():
    with pytest.raises(InputError, check=lambda error: error.code == "history.values"):
        history([[1.0]], np.ones((1, 1, 1)))
    with pytest.raises(InputError, check=lambda error: error.code == "history.covariance"):
        history([[1.0], [2.0]], np.ones(3))
    with pytest.raises(InputError, check=lambda error: error.code == "error.covariance"):
        history([[1.0], [2.0]], np.zeros((2, 1, 1)))
    with pytest.raises(InputError, check=lambda error: error.code == "history.times"):
        history([[1.0], [2.0]], np.ones((2, 1, 1)), times=[1.0, 0.0])
    with pytest.raises(InputError, check=lambda error: error.code == "history.equal-times"):
        history([[1.0], [2.0]], np.ones((2, 1, 1)), times=[1.0, 1.0])
    (change,) = history([[0.0], [9.0]], np.ones((2, 1, 1)), freedom=100.0).series[0].changes
    assert (change.kind, change.at) == ("step", 1)
