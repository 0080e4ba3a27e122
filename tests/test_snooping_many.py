"""Data snooping where many observations are wrong: a robust start, then tests point by point."""

import math

import numpy as np
import pytest

import photogram


def planted(seed, share):
    """Return a block with errors of 10 to 100 standard deviations in a share of the images, and which."""
    block = photogram.simulate(
        strips=3, photos_per_strip=6, points_per_photo=30, side_overlap=0.35, control_spacing=2, seed=seed
    ).block
    random = np.random.default_rng([seed, 7])
    bad = np.flatnonzero(random.random(len(block.image_xy)) < share)
    size, angle = random.uniform(10, 100, len(bad)), random.uniform(0, math.tau, len(bad))
    xy = block.image_xy.copy()
    xy[bad] += (size * block.image_sd[bad, 0] * [np.cos(angle), np.sin(angle)]).T
    names = {
        f"image of point {block.point_ids[block.image_points[row]]} on photo"
        f" {block.photo_ids[block.image_photos[row]]}"
        for row in bad.tolist()
    }
    return block.replace(image_xy=xy), names


@pytest.mark.parametrize("seed", [1000, 1002, 1005])
def test_a_good_ray_goes_only_where_the_bad_one_is_named_beside_it(seed):
    block, bad = planted(seed, 0.05)
    snooped = photogram.snoop(block)
    assert any("a robust adjustment" in remark for remark in snooped.outcome.remarks)
    good = [entry for entry in snooped.removed if entry.name not in bad]
    assert all(bad & {rival.name for rival in entry.in_dispute} for entry in good)
    named = {entry.name for entry in snooped.removed}
    named |= {rival.name for entry in snooped.removed for rival in entry.in_dispute}
    assert len(bad & named) >= 0.9 * len(bad) > 20
    assert 0.8 < snooped.result.variance_of_unit_weight < 1.25
