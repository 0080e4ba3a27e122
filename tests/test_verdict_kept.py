"""The verdict takes over what the adjustment has kept: the same numbers as from a formation of its own."""

import pickle

import numpy as np
import pytest

import photogram
from fuzz.networks import random_network
from photogram import _photocore, adjust
from photogram.results.network_trial import NO_FACTS

TESTED = ("active", "rank", "statistic", "least", "residual", "redundancy", "error", "error_sd")
SEED = 5
HIDDEN = 1e-3
"""Redundancy from which on an error is more than the rounding of what hides it."""


def assert_alike(first, second, tolerance):
    """Compare the tests and effects of two reliabilities, but for what hardly shows."""
    shown = ~(np.nan_to_num(second.tests.least) < HIDDEN)
    rows = shown[second.row_groups()]
    for name in TESTED:
        own, other = (np.asarray(getattr(each.tests, name), dtype=float) for each in (first, second))
        used = shown if len(own) == len(shown) else rows
        np.testing.assert_allclose(own[used], other[used], rtol=tolerance, atol=tolerance, err_msg=name)
    ends = [each.standing for each in (first, second)]
    assert ends[0].degrees_of_freedom == ends[1].degrees_of_freedom
    assert ends[0].weighted_sum_of_squares == pytest.approx(ends[1].weighted_sum_of_squares, rel=1e-12)
    groups = np.flatnonzero(shown).tolist()
    moved = [each.own_points(groups) for each in (first, second)]
    np.testing.assert_allclose(*moved, rtol=100 * tolerance, atol=1e-9)


def own_formation(result):
    """Return a copy of a result, which has kept nothing."""
    return pickle.loads(pickle.dumps(result))


@pytest.mark.parametrize("number", range(20))
def test_random_networks(number):
    """Control, observed stations, observations beside images, cameras, rigs, spheroids; free ones too."""
    block = random_network(SEED, number).block
    result = adjust(block, tolerance=1e-9, covariance="verdict")
    assert_alike(result.reliability(), own_formation(result).reliability(), 1e-6)


def test_the_same_words_and_numbers():
    block = photogram.simulate(strips=3, photos_per_strip=6, points_per_photo=60, seed=4, blunders=2).block
    result = adjust(block, covariance="verdict")
    copied = own_formation(result)
    assert_alike(result.reliability(), copied.reliability(), 1e-7)
    # What was kept is taken once: what is asked later forms its own.
    assert_alike(result.reliability(), copied.reliability(), 1e-14)
    again = adjust(block, covariance="verdict")
    assert again.verdict.headline == copied.verdict.headline
    assert again.report() == copied.report()


def test_check_points_have_the_cofactors_that_were_kept():
    block = photogram.simulate(strips=3, photos_per_strip=6, points_per_photo=60, seed=4).block
    result = adjust(block, tolerance=1e-9, covariance="verdict")
    rows = np.flatnonzero(result.point_kinds == "check").tolist()
    joint = result.state.joint(rows)
    own = result.covariance(("point", [block.point_ids[row] for row in rows])) / result.covariance_scale
    np.testing.assert_allclose(joint, own, rtol=0, atol=1e-7 * own.max())
    assert result.state.joint(rows[1:]) is None
    copied = own_formation(result)
    assert copied.state.joint(rows) is None
    kept, formed = (each.check_points.agreement.together for each in (result, copied))
    assert kept.weighted_sum_of_squares == pytest.approx(formed.weighted_sum_of_squares, rel=1e-6)


@pytest.mark.parametrize("options", [{"loss": "huber"}, {"max_iterations": 2}, {"tolerance": 100.0}])
def test_what_is_not_kept(options):
    """Of a loss, of iterations that have not ended, and where the last step was long: all is as without."""
    block = photogram.simulate(strips=2, photos_per_strip=4, points_per_photo=40, seed=7).block
    result = adjust(block, covariance="verdict", **options)
    assert result.state.joint(np.flatnonzero(result.point_kinds == "check").tolist()) is None
    assert_alike(result.reliability(), own_formation(result).reliability(), 1e-14)


def test_the_adjustment_is_the_same_to_the_last_bit():
    block = photogram.simulate(strips=2, photos_per_strip=4, points_per_photo=40, seed=7).block
    plain, kept = adjust(block), adjust(block, covariance="verdict")
    for name in ("photo_cofactors", "point_cofactors", "redundancy", "standardized", "photo_positions"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(kept, name))


def test_verdicts_do_not_depend_on_threads(monkeypatch):
    block = photogram.simulate(strips=2, photos_per_strip=5, points_per_photo=60, seed=4, blunders=2).block
    documents = []
    for sizes in (range(0), range(10**6)):
        monkeypatch.setattr("photogram.results.findings.IN_PARALLEL", sizes)
        documents.append(adjust(block).verdict.document())
    assert documents[0] == documents[1]


@pytest.mark.parametrize("loss", [None, "huber"])
def test_large_networks_end_their_trial_with_the_hypotheses(monkeypatch, loss):
    block = photogram.simulate(strips=2, photos_per_strip=6, seed=SEED).block
    waiting, ended = (adjust(block, loss=loss, covariance="verdict") for _ in range(2))
    expected = repr(waiting.reliability_summary.document())
    monkeypatch.setattr("photogram.results.evaluation.MOST_WAITING", 0)
    assert repr(ended.reliability_summary.document()) == expected


def test_an_ended_trial_has_no_tests():
    block = photogram.simulate(strips=2, photos_per_strip=4, points_per_photo=40, seed=7).block
    trial = adjust(block)._trial()
    trial.stand()
    facts = {**NO_FACTS, "estimated": None, "detection": (0.001, 0.8), "limit": 5.0, "effects": 4}
    found = [trial.core.hypotheses(**facts, last=last)["statistic"] for last in (False, True)]
    np.testing.assert_array_equal(*found)
    with pytest.raises(_photocore.BlockError):
        trial.tests()
