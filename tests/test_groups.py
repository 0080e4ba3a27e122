"""Tests of groups against a block with three blunders and published problems; their size by simulation."""

import json
import math

import numpy as np
import pytest

from golden_data import golden
from photogram.arguments.arrays import by_occurrence
from photogram.statistics import (
    bonferroni,
    critical_tau,
    externally_studentized,
    group_tests,
    lambda0,
    log_fisher,
    parts_tests,
)
from test_statistics import PUBLISHED

SMALL = PUBLISHED.with_name("small_problems.json")


@pytest.fixture(scope="module")
def block():
    return golden("statistics", "block6_blunders.json")


def grouped(adjustment, size):
    """Return the observations with `size` rows, their blocks of R, and standardized residuals."""
    rows = [each for each in adjustment["observations"] if len(each["residual"]) == size]
    sd = np.array([each["sd"] for each in rows])
    blocks = np.array([each["qvv"] for each in rows]) / (sd[:, :, None] * sd[:, None, :])
    return rows, blocks, np.array([each["residual"] for each in rows]) / sd


@pytest.mark.parametrize("stage", ["adjustment", "adjustment_after_snooping"])
@pytest.mark.parametrize("size", [2, 3])
def test_groups_of_the_block(block, stage, size):
    adjustment = block[stage]
    omega, f = adjustment["omega"], adjustment["dof"]
    rows, blocks, v = grouped(adjustment, size)
    known, unknown = (group_tests(blocks, v, omega, f, known=known) for known in (True, False))
    for k, row in enumerate(rows):
        group = row["group"]
        if group is None or group["T"] is None:
            continue
        assert known.dimension[k] == group["dimension"]
        assert known.statistic[k] == pytest.approx(group["T"], rel=1e-5)
        assert unknown.fisher[k] == pytest.approx(group["F"], rel=1e-5)
        assert math.exp(known.log_probability[k]) == pytest.approx(group["p_chi2"], rel=2e-5)
        assert math.exp(unknown.log_probability[k]) == pytest.approx(group["p_F"], rel=2e-5)
        np.testing.assert_allclose(known.error[k] * row["sd"], group["estimated_error"], rtol=1e-4, atol=1e-7)
        largest = math.sqrt(lambda0(dimension=group["dimension"]) / known.weakest[k])
        assert largest == pytest.approx(group["mdb_standardised_largest"], rel=1e-5)


def test_most_groups_of_two_ray_points_have_one_direction(block):
    tests = [group_tests(*grouped(block["adjustment"], size)[1:]) for size in (2, 3)]
    dimensions = np.concatenate([each.dimension for each in tests])
    assert (len(dimensions), int((dimensions == 1).sum())) == (125, 56)


def test_the_height_is_what_is_wrong_with_the_control_point(block):
    """Of the control with a wrong height, once the other blunders are out."""
    omega, f = block["adjustment"]["omega"], block["adjustment"]["dof"]
    rows, blocks, v = grouped(block["adjustment"], 3)
    one = next(k for k, row in enumerate(rows) if row["observation"][-1] == "033")
    height, plan = parts_tests(blocks[one], v[one], ((2,), (0, 1)), omega, f)
    assert height < plan
    assert group_tests(blocks, v).guilty(one)[0] == 2


def levelled():
    problem = json.loads(PUBLISHED.read_text())["levelling"]
    sd, computed = problem["sd"], problem["computed"]
    return np.array(computed["qvv"]) / sd**2, np.array(computed["residuals"]) / sd, problem


def test_single_observations_are_groups_of_one():
    """The levelling listing: largest normalised residual 1.68 at observation 6."""
    r, v, problem = levelled()
    computed = problem["computed"]
    omega, f = computed["omega"], computed["dof"]
    singles = np.diag(r)[:, None, None]
    known = group_tests(singles, v[:, None])
    w = np.sqrt(known.statistic)
    np.testing.assert_allclose(w, np.abs(computed["w"]), rtol=1e-8)
    assert int(w.argmax()) == 5
    assert w.max() == pytest.approx(1.68, abs=0.005)
    unknown = group_tests(singles, v[:, None], omega, f, known=False)
    np.testing.assert_allclose(np.sqrt(unknown.fisher), np.abs(computed["t_external"]), rtol=1e-8)
    np.testing.assert_allclose(
        externally_studentized(computed["w"], omega, f), computed["t_external"], rtol=1e-8
    )


def test_leaving_a_group_out_lowers_the_sum_by_its_statistic():
    rng = np.random.default_rng(5)
    design, observed = rng.normal(size=(14, 4)), rng.normal(size=14)
    projector = np.eye(14) - design @ np.linalg.pinv(design)
    v = projector @ observed
    group = [3, 8, 9]
    tests = group_tests(projector[np.ix_(group, group)][None], v[group][None], v @ v, 10, known=False)
    others = [row for row in range(14) if row not in group]
    x, (left,), *_ = np.linalg.lstsq(design[others], observed[others])
    assert tests.statistic[0] == pytest.approx(v @ v - left, rel=1e-10)
    assert tests.fisher[0] == pytest.approx(((v @ v - left) / 3) / (left / 7), rel=1e-10)
    # The estimated error is the difference from what the others predict.
    np.testing.assert_allclose(tests.error[0], observed[group] - design[group] @ x, rtol=1e-9)


def test_stack_loss():
    """Printed in many texts: t of observation 21 is -3.33, of 4 2.05; Bonferroni over 21 asks for 3.60."""
    computed = json.loads(PUBLISHED.read_text())["stack_loss"]["computed"]
    r, v = np.array(computed["qvv"]), np.array(computed["residuals"])
    omega = float(v @ v)
    tests = group_tests(np.diag(r)[:, None, None], v[:, None], omega, 17, known=False)
    t = np.sqrt(tests.fisher) * np.sign(v)
    assert t[20] == pytest.approx(-3.3305, abs=5e-5)
    assert t[3] == pytest.approx(2.0518, abs=5e-5)
    assert tests.log_probability.min() > math.log(bonferroni(0.05, 21))


def test_three_outliers_mask_each_other():
    """Rosner's data: tau of the first two steps is below its limit, that of the third above."""
    rosner = json.loads(PUBLISHED.read_text())["rosner"]
    values, beyond = np.sort(rosner["values"]), []
    for step in rosner["steps"]:
        n = len(values)
        v = values - values.mean()
        tau = v / math.sqrt((v @ v) / (n - 1)) / math.sqrt(1 - 1 / n)
        worst = int(np.abs(tau).argmax())
        limit = critical_tau(bonferroni(0.05, n), n - 1)
        assert values[worst] == step["removed"]
        assert abs(tau[worst]) == pytest.approx(abs(step["tau"]), rel=1e-8)
        assert limit == pytest.approx(step["tau_critical"], rel=1e-8)
        assert limit * math.sqrt((n - 1) / n) == pytest.approx(step["published_critical"], abs=1e-3)
        beyond.append(abs(tau[worst]) > limit)
        values = np.delete(values, worst)
    assert beyond.index(True) == 2
    assert sum(beyond) == 1


def test_the_largest_test_may_belong_to_a_good_observation():
    """The levelling net with two blunders: w, tau and t of all observations."""
    swamping = json.loads(SMALL.read_text())["swamping"]
    edges, sd = np.array(swamping["edges"]), swamping["sd"]
    design = np.zeros((len(edges), 7))
    rows = np.arange(len(edges))
    design[rows, edges[:, 1]] += 1 / sd
    design[rows, edges[:, 0]] -= 1 / sd
    design = design[:, 1:]
    projector = np.eye(len(edges)) - design @ np.linalg.pinv(design)
    v = projector @ np.array(swamping["dh"]) / sd
    first = swamping["first"]
    assert v @ v == pytest.approx(first["omega"], rel=1e-8)
    tests = group_tests(np.diag(projector)[:, None, None], v[:, None], v @ v, first["dof"], known=False)
    np.testing.assert_allclose(np.sqrt(tests.statistic), np.abs(first["w"]), rtol=1e-8)
    np.testing.assert_allclose(np.sqrt(tests.fisher), np.abs(first["t"]), rtol=1e-8)
    assert int(tests.statistic.argmax()) == 2
    assert 2 not in [each["observation"] for each in swamping["blunders"]]


def test_rows_that_do_not_exist_and_directions_that_are_not_seen():
    block = np.array([[0.5, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.0]])
    tests = group_tests([block, block], [[1.0, 2.0, 5.0], [math.nan, math.nan, 3.0]])
    assert tests.dimension.tolist() == [2, 0]
    assert tests.statistic.tolist() == pytest.approx([1 / 0.5 + 4 / 0.4, 0.0])
    assert math.isnan(tests.log_probability[1])
    assert tests.guilty(1) == []
    # f is no more than the dimension: nothing is left to compare with.
    assert math.isnan(group_tests([block], [[1.0, 2.0, 0.0]], 12.0, 2, known=False).log_probability[0])


def test_components_that_cannot_be_told_apart_are_named_together():
    direction = np.array([0.8, 0.6])
    tests = group_tests([0.3 * np.outer(direction, direction)], [0.9 * direction])
    assert tests.dimension.tolist() == [1]
    assert tests.guilty(0) == [0, 1]


def test_sizes():
    """One good group in a hundred is rejected at the level of 1 percent, whatever its dimension."""
    rng = np.random.default_rng(29)
    design = rng.normal(size=(20, 6))
    projector = np.eye(20) - design @ np.linalg.pinv(design)
    groups = [[0], [3, 4], [7, 8, 9]]
    draws = projector @ rng.normal(size=(20, 20_000))
    omegas = (draws**2).sum(axis=0)
    for rows in groups:
        blocks = np.broadcast_to(projector[np.ix_(rows, rows)], (draws.shape[1], len(rows), len(rows)))
        chi = group_tests(blocks, draws[rows].T)
        assert (chi.log_probability < math.log(0.01)).mean() == pytest.approx(0.01, abs=0.0025)
        # F, one by one in omega: T is the same.
        m = len(rows)
        fisher = (chi.statistic / m) / ((omegas - chi.statistic) / (14 - m))
        one = group_tests(blocks[:1], draws[rows, :1].T, omegas[0], 14, known=False)
        assert one.fisher[0] == pytest.approx(fisher[0])
        assert (log_fisher(fisher, m, 14 - m) < math.log(0.01)).mean() == pytest.approx(0.01, abs=0.0025)


def test_numbers_are_listed_by_first_occurrence():
    assert by_occurrence(np.array([3, 1, 3, 0, 1])).tolist() == [3, 1, 0]
    assert by_occurrence(np.empty(0, dtype=np.int64)).tolist() == []
