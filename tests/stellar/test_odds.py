"""Odds against chance: golden values, fields of no star in common, simulated nights."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from photogram.stellar.identification import ACCEPTED, Search, expected_false, match

NIGHTS = runpy.run_path(str(Path(__file__).parents[2] / "benches" / "star_nights.py"))
FRAME = (6000.0, 4000.0)


@pytest.mark.parametrize(
    ("images", "fixing", "mu", "matched", "hypotheses", "probability", "accepted"),
    [
        (10, 2, 0.01, 8, 1e4, 2.671166787e-11, True),
        (10, 2, 0.01, 5, 1e4, 5.31410072e-05, False),
        (10, 2, 0.05, 8, 1e5, 3.459647331e-07, False),
        (20, 2, 0.05, 14, 1e5, 2.550476716e-12, True),
        (20, 2, 0.2, 14, 1e5, 7.816805221e-06, False),
        (20, 3, 0.2, 18, 1e6, 7.025727531e-10, False),
        (30, 2, 0.3, 15, 1e6, 0.01528354052, False),
        (30, 2, 0.02, 10, 1e6, 5.153988627e-08, False),
        (6, 2, 0.005, 6, 1e3, 6.187837244e-10, True),
        (6, 2, 0.005, 5, 1e3, 4.944092271e-07, False),
        (8, 2, 0.1, 8, 1e4, 7.426724285e-07, False),
        (40, 2, 0.1, 20, 1e7, 2.090162955e-09, False),
    ],
)
def test_the_golden_odds(images, fixing, mu, matched, hypotheses, probability, accepted):
    assert expected_false(images, fixing, mu, matched) == pytest.approx(probability, rel=1e-9)
    assert (expected_false(images, fixing, mu, matched, hypotheses) < ACCEPTED) == accepted


def test_odds_at_their_limits():
    assert expected_false(10, 2, 0.1, 2) == 1.0
    assert expected_false(10, 2, 0.0, 3) == 0.0
    assert expected_false(10, 2, 0.1, 11) == 0.0
    # Fewer than the smallest number that is not zero.
    assert 0 <= expected_false(5000, 2, 1e-6, 5000) < 1e-300


def test_fields_of_no_star_in_common_are_not_matched():
    """Images and stars at random: the expected number of chance matches is met, and none is accepted."""
    generator = np.random.default_rng(12)
    expected = []
    for images, stars, radius, tolerance in [(100, 400, 157, 8), (40, 900, 157, 12), (60, 300, 1265, 8)] * 8:
        measured = generator.uniform((0, 0), FRAME, (images, 2))
        predicted = generator.uniform(-radius, np.array(FRAME) + radius, (stars, 2))
        found = match(measured, predicted, Search(FRAME, radius), tolerance=tolerance)
        assert not found.accepted
        expected.append(found.expected)
    # Of 24 fields, E below a tenth comes up in two or three at most where E is what it says.
    assert sum(value < 0.1 for value in expected) <= 6
    assert min(expected) > 1e-4


def test_a_crowded_field_is_not_counted():
    generator = np.random.default_rng(13)
    measured = generator.uniform((0, 0), FRAME, (200, 2))
    found = match(measured, measured.copy(), Search(FRAME, 157.0), tolerance=120.0)
    assert found.crowded
    assert not found.accepted


@pytest.mark.parametrize("seed", [0, 1, 4, 5, 7, 17, 19])
def test_no_simulated_night_ends_wrong(seed):
    """`benches/star_nights.py` runs hundreds; roll unknown in the odd ones, and not said in 19."""
    sky = NIGHTS["make"](seed)
    end, about, _ = NIGHTS["verdict"](sky)
    assert end != "wrong", about
    if abs(sky.field_error) < 0.01 and sky.roll != "unknown, not said":
        assert end == "right", about
