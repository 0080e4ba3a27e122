"""A small object in twelve photos of which nothing but the images is known, and a scale bar.

One image in twenty is wrong. First values come from relative orientation and chaining; wrong images are set
aside, and the rest is adjusted as a free network. Prints how each photo was started and how the adjustment
ended.
"""

from __future__ import annotations

import numpy as np

from photogram import Block, Distance, FirstValues, Result, adjust, first_values
from photogram.network import project, rotation_angles, rotation_matrix

PRINCIPAL_DISTANCE = -50.0
HALF_FORMAT = 18.0
IMAGE_SD = 0.002
"""Millimetres."""
WRONG = 0.05


def measured(seed: int = 5) -> Block:
    """Return the block with its measurements, without poses; errors are drawn with the given seed."""
    random = np.random.default_rng(seed)
    points = random.uniform([-1.0, -1.0, 0.0], [1.0, 1.0, 1.2], (60, 3))
    turn = 2 * np.pi * np.arange(12) / 12
    stations = np.column_stack([5 * np.cos(turn), 5 * np.sin(turn), 0.6 + 0.0 * turn])
    # Level axes that look at the middle: phi is 90 degrees on one photo, -90 on another.
    back = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    right = np.column_stack([-np.sin(turn), np.cos(turn), 0 * turn])
    up = np.tile([0.0, 0.0, 1.0], (12, 1))
    attitudes = rotation_angles(np.stack([right, up, back], axis=1))
    photos, seen = np.repeat(np.arange(12), 60), np.tile(np.arange(60), 12)
    xy = project(points[seen], stations[photos], attitudes[photos], np.full(720, PRINCIPAL_DISTANCE))
    xy += IMAGE_SD * random.standard_normal(xy.shape)
    wrong = random.random(720) < WRONG
    xy[wrong] = random.uniform(-HALF_FORMAT, HALF_FORMAT, (int(wrong.sum()), 2))
    length = float(np.linalg.norm(points[1] - points[0]))
    return Block(
        photo_ids=[f"S{i}" for i in range(12)],
        photo_positions=np.full((12, 3), np.nan),
        photo_attitudes=np.full((12, 3), np.nan),
        principal_distances=np.full(12, PRINCIPAL_DISTANCE),
        point_ids=[f"P{i}" for i in range(60)],
        point_positions=np.full((60, 3), np.nan),
        image_photos=photos,
        image_points=seen,
        image_xy=xy,
        image_sd=np.full(xy.shape, IMAGE_SD),
        title="twelve photos, a scale bar, nothing else",
        observations=[Distance("P0", "P1", length, sd=1e-4)],
    )


def started_and_adjusted() -> tuple[FirstValues, Result]:
    """Find first values and adjust."""
    started = first_values(measured())
    return started, adjust(started.usable())


def main() -> None:
    """Print what was found."""
    started, result = started_and_adjusted()
    for message in started.messages:
        print(message)
    phi = np.degrees(np.arcsin(rotation_matrix(started.block.photo_attitudes)[:, 2, 0]))
    print(f"phi of the photos from {phi.min():.0f} to {phi.max():.0f} degrees")
    variance = result.variance_of_unit_weight
    assert variance is not None
    print(f"{result.status} in {len(result.iterations)} iterations, sigma0 {np.sqrt(variance):.3f}")


if __name__ == "__main__":
    main()
