"""Similarities that pairs of images and stars make, against all pairs written out."""

import numpy as np
import pytest

from photogram import InputError, _photocore


def scene(seed=5):
    """Thirty stars, of which twelve are images under a turn of 0.4, and six false images."""
    generator = np.random.default_rng(seed)
    stars = generator.uniform(0, 1000, (30, 2))
    factor, shift = 1.01 * np.exp(0.4j), 30 - 20j
    images = (stars[:12] @ [1, 1j] - shift) / factor
    false = generator.uniform(0, 1000, (6, 2))
    images = np.vstack([np.column_stack([images.real, images.imag]), false])
    candidates = np.stack(np.meshgrid(np.arange(18), np.arange(30), indexing="ij"), axis=-1).reshape(-1, 2)
    return images, stars, candidates, factor, shift


def similarities(images, stars, candidates, **changed):
    given = {"makers": 18, "tolerance": 5.0, "stretch": 0.02, "least": 150.0, "axis": None}
    return _photocore.star_similarities(
        images, stars, candidates, **{**given, "limit": 8.0, "wanted": 6, **changed}
    )


def all_pairs(images, stars, candidates, axis=None):
    """Count the pairs of candidates that agree."""
    z, s = images @ [1, 1j], stars @ [1, 1j]
    (i, k), (j, m) = (candidates[side].T for side in np.triu_indices(len(candidates), 1))
    first, second = np.abs(z[j] - z[i]), np.abs(s[m] - s[k])
    agree = (np.abs(first - second) < 5 + 0.02 * first) & (first > 150) & (k != m)
    factor = (s[m] - s[k])[agree] / (z[j] - z[i])[agree]
    if axis is None:
        return len(factor)
    centre = complex(*axis[0])
    return int((np.abs(factor * centre + s[k][agree] - factor * z[i][agree] - centre) <= axis[1]).sum())


def test_every_pair_that_agrees_is_counted_and_the_true_one_is_best():
    images, stars, candidates, factor, shift = scene()
    made, best = similarities(images, stars, candidates)
    assert made == all_pairs(images, stars, candidates) > 4096
    assert best.shape == (6, 4)
    assert np.allclose(best @ [[1, 0], [1j, 0], [0, 1], [0, 1j]], [factor, shift], atol=1e-6)


@pytest.mark.parametrize("radius", [60.0, 400.0])
def test_the_axis_stays_where_it_may_be(radius):
    images, stars, candidates, *_ = scene()
    axis = ((500.0, 480.0), radius)
    made, best = similarities(images, stars, candidates, axis=axis)
    assert made == all_pairs(images, stars, candidates, axis)
    moved = best @ [1, 1j, 0, 0] * complex(*axis[0]) + best @ [0, 0, 1, 1j] - complex(*axis[0])
    assert (np.abs(moved) <= radius).all()


def test_of_no_pair_there_is_none():
    images, stars, candidates, *_ = scene()
    made, best = similarities(images, stars, candidates, least=5000.0)
    assert made == 0
    assert best.shape == (0, 4)
    assert similarities(images, stars, candidates[:0])[0] == 0


def test_what_is_no_candidate_is_refused():
    images, stars, *_ = scene()
    for wrong in ([[18, 0]], [[0, 30]], [[-1, 0]]):
        with pytest.raises(ValueError, match="a candidate is no image and star"):
            similarities(images, stars, np.array(wrong))
    with pytest.raises(InputError, match=r"candidates has the shape \(1, 3\)"):
        similarities(images, stars, np.array([[0, 0, 0]]))
    with pytest.raises(InputError, match="but has 1 rows, but points has 18"):
        _photocore.nearest_points(images, stars, 1.0, np.array([0]))


def test_one_of_the_others_may_not_count():
    points, others = np.array([[0.0, 0.0], [9.0, 0.0]]), np.array([[0.5, 0.0], [0.0, 1.0], [9.0, 0.1]])
    assert _photocore.nearest_points(points, others, 2.0).tolist() == [0, 2]
    assert _photocore.nearest_points(points, others, 2.0, np.array([0, 2])).tolist() == [1, -1]
    assert _photocore.nearest_points(points, others, 2.0, np.array([-1, -1])).tolist() == [0, 2]
