"""Simulated collections: photos around a cloud of points, and a distant object on a turntable."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.collection.collection import Collection
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

DISTANCE = 10.0  # Distance of the photos from the centre of the cloud
SIZE = 4.0  # Side of the cloud, a cube
FIELD = 400.0  # Image radius of the object on a turntable, pixels


@dataclass(frozen=True, eq=False)
class Simulation:
    """Simulated collection with its true values.

    Attributes
    ----------
    collection
        Simulated input: measured images and approximate initial values.
    truth
        The same collection with true parameters and positions.
    outliers
        (m,) image observations with a gross error.
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
    """Simulate photos on a circle around a cube of points, each with its own camera.

    The circle has a radius of 10, the cube a side of 4; focal lengths are 800 to 1200 pixels.

    Parameters
    ----------
    photos, points
        Number of photos and of points.
    seen
        Part of the photos that see a point; at least two photos.
    noise
        Standard deviation of image coordinates, pixels.
    coarseness
        Error of the initial values. 1: standard deviations of 0.05 rad, 0.5 for translations and points and
        10 percent for focal lengths, and zero distortion. 0: true values.
    outlier_share, outlier_size
        Share of image points with a gross error, and its standard deviation in pixels.
    seed
        The same seed gives the same collection.

    Raises
    ------
    InputError
        If there are fewer than two photos, a share is outside 0 to 1, or a value is negative.
    """
    if photos < 2 or points < 1:
        raise InputError(phrase("collection.few-photos", photos=2, rays=2, given=[photos, points]))
    if not (0 <= seen <= 1 and 0 <= outlier_share <= 1):
        raise InputError(phrase("collection.share", given=[seen, outlier_share]))
    _not_negative(noise=noise, outlier_size=outlier_size, seed=seed)
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
    truth = _measured(parameters, positions, (image_photos, image_points), exact + errors, noise)
    start = parameters.copy()
    start[:, :3] += coarseness * random.normal(0, 0.05, (photos, 3))
    start[:, 3:6] += coarseness * random.normal(0, 0.5, (photos, 3))
    start[:, 6] *= 1 + coarseness * random.normal(0, 0.1, photos)
    start[:, 7:] *= 0.0 if coarseness else 1.0
    coarse = positions + coarseness * random.normal(0, 0.5, positions.shape)
    return Simulation(truth.replace(photo_parameters=start, point_positions=coarse), truth, outliers)


def simulate_turntable(
    *,
    photos: int = 177,
    points: int = 4217,
    rays: int = 31,
    distance: float = 175.0,
    noise: float = 0.5,
    coarseness: float = 1.0,
    seed: int = 0,
) -> Simulation:
    """Simulate an object on a turntable with nearly parallel rays (long focal length).

    The object is a bumpy pillar with a radius of about 1 and a height of 2; its image is 800 pixels wide.
    Each photo has its own camera, whose focal length and distance are hardly separable. The network is weak:
    its sum of squares has a long curved valley.

    Parameters
    ----------
    photos, points
        Number of photos and of points; photos are all around.
    rays
        Number of nearest photos that see a point, at least two.
    distance
        Distance of the photos from the axis. By default the standard deviation of a focal length is a fifth
        of it.
    noise
        Standard deviation of image coordinates, pixels.
    coarseness
        Error of the initial values. 1: standard deviations of 0.01 rad, 0.02 across the line of sight, 20
        percent for focal lengths and distances together, 0.5 percent for distances separately and 0.05 for
        points, and zero distortion. 0: true values.
    seed
        The same seed gives the same collection.

    Raises
    ------
    InputError
        If there are fewer than two photos or rays, no points, or a value is negative.
    """
    if photos < 2 or points < 1 or not 2 <= rays <= photos:
        raise InputError(phrase("collection.few-photos", photos=2, rays=2, given=[photos, points, rays]))
    _not_negative(noise=noise, coarseness=coarseness, seed=seed)
    if not distance > 2:
        raise InputError(phrase("collection.distance", value=distance))
    random = np.random.default_rng(seed)
    parameters = _on_turntable(photos, distance, random)
    positions, angle = _pillar(points, random)
    around = 2 * np.pi * np.arange(photos) / photos
    apart = np.abs((angle[:, None] - around + np.pi) % (2 * np.pi) - np.pi)
    image_photos = np.sort(np.argsort(apart, axis=1, kind="stable")[:, :rays], axis=1).ravel()
    image_points = np.repeat(np.arange(points), rays)
    exact = _photocore.collection_images("bal", parameters[image_photos], positions[image_points])
    measured = exact + random.normal(0, noise, exact.shape)
    truth = _measured(parameters, positions, (image_photos, image_points), measured, noise)
    start = parameters.copy()
    start[:, :3] += coarseness * random.normal(0, 0.01, (photos, 3))
    start[:, 3:5] += coarseness * random.normal(0, 0.02, (photos, 2))
    # A focal length that is too long moves the camera too far away.
    longer = np.exp(coarseness * random.normal(0, 0.2, photos))
    start[:, 5] *= longer * (1 + coarseness * random.normal(0, 0.005, photos))
    start[:, 6] *= longer
    start[:, 7:] *= 0.0 if coarseness else 1.0
    coarse = positions + coarseness * random.normal(0, 0.05, positions.shape)
    return Simulation(
        truth.replace(photo_parameters=start, point_positions=coarse), truth, np.zeros(len(exact), dtype=bool)
    )


def _not_negative(**given: float) -> None:
    if not all(value >= 0 for value in given.values()):
        raise InputError(phrase("collection.negative", names=list(given), given=list(given.values())))


def _cameras(photos: int, random: np.random.Generator) -> Floats:
    """Return (photos, 9) parameters of photos around the origin that look at it."""
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


def _on_turntable(photos: int, distance: float, random: np.random.Generator) -> Floats:
    """Return (photos, 9) parameters of photos that see the axis of a turntable from a distance."""
    parameters = np.zeros((photos, 9))
    parameters[:, 1] = -2 * np.pi * np.arange(photos) / photos
    parameters[:, :3] += random.normal(0, 0.01, (photos, 3))
    parameters[:, 3:5] = random.normal(0, 0.02, (photos, 2))
    parameters[:, 5] = -distance * (1 + random.normal(0, 0.005, photos))
    parameters[:, 6] = FIELD * distance * (1 + random.normal(0, 0.02, photos))
    # The displacement at the edge of the object is a thousandth of the radius.
    parameters[:, 7] = random.normal(0, 0.001, photos) * distance**2
    return parameters


def _pillar(points: int, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Return (points, 3) positions on a bumpy pillar and (points,) directions from its axis, radians."""
    angle, height = random.uniform(0, 2 * np.pi, points), random.uniform(-1, 1, points)
    radius = 0.8 + 0.2 * np.cos(3 * angle) * np.cos(2 * height) + random.normal(0, 0.05, points)
    return np.column_stack([radius * np.sin(angle), height, radius * np.cos(angle)]), angle


def _measured(
    parameters: Floats, positions: Floats, incidence: tuple[Indices, Indices], xy: Floats, noise: float
) -> Collection:
    """Return a collection with measured images; errorless ones have a standard deviation of 1 px."""
    photos, points = incidence
    return Collection(
        photo_parameters=parameters,
        point_positions=positions,
        image_photos=photos,
        image_points=points,
        image_xy=xy,
        image_sd=np.array(noise if noise > 0 else 1.0),
    )
