"""Simulated collections: photos all around a cloud of points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.collection.collection import Collection
from photogram.errors import InputError

__all__ = ["Simulation", "simulate"]

DISTANCE = 10.0
"""Of the photos from the centre of the cloud."""
SIZE = 4.0
"""Side of the cloud, a cube."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """A simulated collection and the truth behind it.

    Attributes
    ----------
    collection
        What would be given: measured images, coarse initial values.
    truth
        The same with true parameters and positions.
    outliers
        (m,) which image points have a gross error.
    """

    collection: Collection
    truth: Collection
    outliers: NDArray[np.bool_]


def simulate(
    *,
    photos: int = 8,
    points: int = 60,
    seen: float = 0.7,
    noise: float = 0.5,
    coarseness: float = 1.0,
    outlier_share: float = 0.0,
    outlier_size: float = 100.0,
    seed: int = 0,
) -> Simulation:
    """Simulate photos on a circle around a cube full of points, every photo with a camera of its own.

    The circle has a radius of 10, the cube a side of 4; focal lengths are 800 to 1200 pixels.

    Parameters
    ----------
    photos, points
        How many.
    seen
        Share of the photos that see a point; two at least.
    noise
        Standard deviation of image coordinates, pixels.
    coarseness
        Of the initial values: 1 gives standard deviations of 0.05 rad, of 0.5 for translations and points
        and of 10 percent for focal lengths, and starts without distortion; 0 starts at the truth.
    outlier_share, outlier_size
        Share of image points with a gross error, and its standard deviation in pixels.
    seed
        The same seed gives the same collection.

    Raises
    ------
    InputError
        Fewer than two photos, shares outside 0 to 1, what is negative.
    """
    if photos < 2 or points < 1:
        raise InputError(f"there must be two photos and a point at least, not {photos} and {points}")
    if not (0 <= seen <= 1 and 0 <= outlier_share <= 1):
        raise InputError("shares lie between 0 and 1")
    if not (noise >= 0 and outlier_size >= 0 and seed >= 0):
        raise InputError("noise, size of outliers and seed are not negative")
    random = np.random.default_rng(seed)
    parameters = _cameras(photos, random)
    positions = random.uniform(-SIZE / 2, SIZE / 2, (points, 3))
    visible = random.random((points, photos)) < seen
    for own in visible:
        own[random.choice(photos, 2, replace=False)] = True
    image_points, image_photos = np.nonzero(visible)
    exact = _photocore.collection_images("bal", parameters[image_photos], positions[image_points])
    outliers = random.random(len(exact)) < outlier_share
    errors = random.normal(0, noise, exact.shape)
    errors[outliers] += random.normal(0, outlier_size, (int(outliers.sum()), 2))
    truth = Collection(
        photo_parameters=parameters,
        point_positions=positions,
        image_photos=image_photos,
        image_points=image_points,
        image_xy=exact + errors,
        image_sd=np.array(noise if noise > 0 else 1.0),
    )
    start = parameters.copy()
    start[:, :3] += coarseness * random.normal(0, 0.05, (photos, 3))
    start[:, 3:6] += coarseness * random.normal(0, 0.5, (photos, 3))
    start[:, 6] *= 1 + coarseness * random.normal(0, 0.1, photos)
    start[:, 7:] *= 0.0 if coarseness else 1.0
    coarse = positions + coarseness * random.normal(0, 0.5, positions.shape)
    return Simulation(truth.replace(photo_parameters=start, point_positions=coarse), truth, outliers)


def _cameras(photos: int, random: np.random.Generator) -> Floats:
    """Return (photos, 9) parameters of photos that look at the origin from all around."""
    around = np.linspace(-np.pi, np.pi, photos, endpoint=False) + np.pi / photos
    parameters = np.zeros((photos, 9))
    parameters[:, 1] = -around
    parameters[:, :3] += random.normal(0, 0.05, (photos, 3))
    parameters[:, 5] = -DISTANCE
    parameters[:, 3:6] += random.normal(0, 0.3, (photos, 3))
    parameters[:, 6] = random.uniform(800, 1200, photos)
    parameters[:, 7] = random.uniform(-0.1, 0.1, photos)
    parameters[:, 8] = random.uniform(-0.05, 0.05, photos)
    return parameters
