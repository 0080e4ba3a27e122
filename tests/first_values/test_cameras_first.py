"""Cameras with a wrong principal distance: they are estimated before images and photos are set aside."""

import networks
import numpy as np
import pytest

from photogram import Block, Camera, adjust_started, first_values
from photogram.network import project

TRUE_C = 24.56
FRAME = np.array([18.0, 12.0])


def distorted(ideal, k1):
    """Return the images that the radial term reduces to ideal ones, and whether there are any."""
    image = ideal.copy()
    for _ in range(50):
        image = ideal / (1 + k1 * (image**2).sum(axis=1, keepdims=True))
    back = image * (1 + k1 * (image**2).sum(axis=1, keepdims=True))
    return image, (np.abs(back - ideal) < 1e-9).all(axis=1) & (np.abs(image) < FRAME).all(axis=1)


def convergent(seed, *, photos=30, targets=60, control=5):
    """Return 30 photos around 60 targets, without poses, whose camera starts from c = 24 without a lens."""
    rng = np.random.default_rng(seed)
    k1 = rng.uniform(1e-4, 2e-4) * rng.choice([-1, 1])
    noise = rng.uniform(0.0005, 0.001)
    points = rng.uniform(-1, 1, (targets, 3))
    azimuth, height = rng.uniform(0, 2 * np.pi, photos), rng.uniform(0, 1.5, photos)
    level = np.cos(height)
    positions = np.column_stack([np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(height)])
    positions *= rng.uniform(2, 3, photos)[:, np.newaxis]
    rolls = rng.choice([0, np.pi / 2, np.pi, -np.pi / 2], photos) + rng.normal(0, 0.1, photos)
    aims = rng.normal(0, 0.15, (photos, 3))
    images = []
    for photo, (position, aim, roll) in enumerate(zip(positions, aims, rolls, strict=True)):
        turn = networks.looking_at(position[np.newaxis], aim[np.newaxis], roll=roll)[0]
        many = np.ones((targets, 1))
        ideal = project(points, many * position, many * turn, np.full(targets, -TRUE_C))
        image, there = distorted(ideal, k1)
        there &= (points - position) @ networks.rotation(turn)[2] < 0
        images += [(photo, point, *image[point]) for point in np.flatnonzero(there)]
    rows = np.array(images)
    known, sd = np.full((targets, 3), np.nan), np.full((targets, 3), np.inf)
    own = rng.choice(targets, control, replace=False)
    known[own], sd[own] = points[own], 0.0001
    unknown = dict.fromkeys(("c", "xp", "yp", "K1"), np.inf)
    return Block(
        photo_ids=[f"F{photo}" for photo in range(photos)],
        photo_positions=np.nan,
        photo_attitudes=np.nan,
        cameras=[Camera("brown", {"c": -24.0}, unknown)],
        photo_cameras=np.zeros(photos, dtype=int),
        point_ids=[f"P{point}" for point in range(targets)],
        point_positions=known,
        point_sd=sd,
        image_photos=rows[:, 0].astype(int),
        image_points=rows[:, 1].astype(int),
        image_xy=rows[:, 2:] + rng.normal(0, noise, (len(rows), 2)),
        image_sd=0.001,
    )


@pytest.mark.parametrize("seed", [0, 1, 5, 11, 12, 14, 124])
def test_all_photos_and_images_take_part(seed):
    block = convergent(seed)
    started = first_values(block)
    assert not started.missing
    assert started.contradicted_control == ()
    assert not started.set_aside.any()
    assert started.block.cameras == block.cameras
    result = adjust_started(started)
    assert result.converged
    assert result.set_aside == ()
    assert result.variance_of_unit_weight < 1.2
    (camera,) = result.cameras
    assert abs(camera.values[0] + TRUE_C) < 0.005
