"""Patterns of residuals against draws of residuals without any."""

import itertools

import numpy as np
import pytest

from message_codes import nested_codes
from photogram import InputError, adjust, simulate
from photogram.results import drawn_patterns
from photogram.statistics.patterns import durbin_watson, moran, moran_index

BLOCK = simulate(strips=2, photos_per_strip=4, seed=5).block


def test_moran_is_its_double_sum():
    random = np.random.default_rng(3)
    xy, photos = random.uniform(-100, 100, (60, 2)), random.integers(0, 4, 60)
    z = random.normal(size=(60, 2))
    low, width = xy.min(axis=0), np.ptp(xy, axis=0)
    cell = np.minimum((10 * (xy - low) / width).astype(int), 9)
    total = weights = 0.0
    for i in range(60):
        near = [j for j in range(60) if (cell[i] == cell[j]).all() and photos[i] != photos[j]]
        for j in near:
            total += z[i] @ z[j] / len(near)
            weights += 1 / len(near)
    assert moran(xy, photos, z) == pytest.approx(60 / weights * total / (z**2).sum())


def test_durbin_and_watson_by_hand():
    """Means 1, 2, 4 of three photos with a redundancy of 1 each: (1 + 4) / 21 in x, and the same in y."""
    photos = np.array([0, 1, 2])
    v = np.array([[1.0, 1.0], [2.0, 2.0], [4.0, 4.0]])
    assert durbin_watson(photos, 3, v, np.ones((3, 2))) == pytest.approx(5 / 21)
    assert np.isnan(durbin_watson(photos[:2], 2, v[:2], np.ones((2, 2))))


def test_moran_of_primates():
    """Body weights of five primates, weights from their phylogeny, rows of sum 1: I = -0.07312179.

    E. Paradis, "Moran's autocorrelation coefficient in comparative methods", vignette of the R package ape,
    section 2, with data of Cheverud, Dow and Leutenegger (1985).
    """
    body = np.array([4.09434, 3.61092, 2.37024, 2.02815, -1.46968])
    apart = np.array(
        [
            [np.inf, 0.42, 0.98, 1.24, 2.0],
            [0.42, np.inf, 0.98, 1.24, 2.0],
            [0.98, 0.98, np.inf, 1.24, 2.0],
            [1.24, 1.24, 1.24, np.inf, 2.0],
            [2.0, 2.0, 2.0, 2.0, np.inf],
        ]
    )
    weights = 1 / apart / (1 / apart).sum(axis=1, keepdims=True)
    z = body - body.mean()
    assert moran_index(z, weights @ z, weights.sum()) == pytest.approx(-0.07312179, abs=5e-9)


def test_durbin_and_watson_of_the_blaisdell_company():
    """Company sales on industry sales, 20 quarters: e1 = -0.026052, ..., e20 = -0.033009, D = 0.735.

    Kutner, Nachtsheim, Neter and Li, Applied Linear Statistical Models, 5th edition, 2005, table 12.2 and
    section 12.3.
    """
    industry = [127.3, 130.0, 132.7, 129.4, 135.0, 137.1, 141.2, 142.8, 145.5, 145.3]
    industry += [148.3, 146.4, 150.2, 153.1, 157.3, 160.7, 164.2, 165.6, 168.7, 171.7]
    company = [20.96, 21.40, 21.96, 21.52, 22.39, 22.76, 23.48, 23.66, 24.10, 24.01]
    company += [24.54, 24.30, 25.00, 25.64, 26.36, 26.98, 27.52, 27.78, 28.24, 28.78]
    design = np.column_stack([np.ones(20), industry])
    residuals = np.array(company) - design @ np.linalg.lstsq(design, np.array(company), rcond=None)[0]
    assert residuals[[0, -1]] == pytest.approx([-0.026052, -0.033009], abs=5e-7)
    # One image on each photo, the same in x and y.
    d = durbin_watson(np.arange(20), 20, np.column_stack([residuals, residuals]), np.ones((20, 2)))
    assert d == pytest.approx(0.735, abs=5e-4)


def test_a_good_block_has_no_pattern_and_waves_have_one():
    good = drawn_patterns(adjust(BLOCK), draws=60)
    assert {each.statistic for each in good} == {"B", "I", "d"}
    assert all(each.probability > 0.02 and each.draws == 60 for each in good)
    xy = BLOCK.image_xy
    waves = adjust(BLOCK.replace(image_xy=xy + 0.010 * np.sin(xy[:, ::-1] / 30)))
    found = {each.statistic: each for each in drawn_patterns(waves, draws=60)}
    assert found["B"].probability == found["I"].probability == pytest.approx(1 / 61)
    assert found["I"].value > found["I"].expected + 4 * found["I"].sd


def test_probabilities_are_uniform_where_there_is_no_pattern():
    """Of 40 blocks without a pattern about as many have a p above a half as below, and few a small one."""
    p = []
    for seed in range(40):
        block = simulate(strips=1, photos_per_strip=4, points_per_photo=40, seed=seed).block
        p.append([each.probability for each in drawn_patterns(adjust(block), draws=19)])
    for column in itertools.zip_longest(*p):
        values = np.array([each for each in column if each is not None])
        assert len(values) > 30
        assert 0.3 < values.mean() < 0.7
        assert (values <= 0.05).mean() < 0.2


def test_what_cannot_be_tested():
    with pytest.raises(InputError) as error:
        drawn_patterns(adjust(BLOCK, loss="huber"))
    assert error.value.code == "models.patterns"
    with pytest.raises(InputError) as error:
        drawn_patterns(adjust(BLOCK), draws=0)
    assert "error.positive" in nested_codes(error.value)
