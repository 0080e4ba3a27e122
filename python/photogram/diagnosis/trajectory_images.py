"""Images of photos on trajectories against those predicted from the given tables, points and cameras.

m = rms(observed - predicted) / rms(observed - mean)          (:mod:`photogram.diagnosis.regression`)

Samples and lines of scanners are image coordinates like others here: what their trajectory passes at a wrong
time, or with a wrong attitude, is seen many lines away.
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.regression import UNKNOWN, given_points, spread
from photogram.errors import InputError
from photogram.network.block import Block
from photogram.network.directions import image_directions
from photogram.network.geometry import geographic_to_geocentric
from photogram.network.motion import given_poses, timed_images, timed_photos
from photogram.network.projecting import camera_of, projected
from photogram.network.rays import meet
from photogram.network.subset import kept_images

__all__ = ["flown_misfits", "flown_predictions", "flown_view"]

LEAST = 4
"""Points with a place that a photo which is looked at has."""
MOST = 12
"""Photos that are looked at."""
POINTS = 300
"""Points of each of them."""
SEEN = 0.8
"""Of the points of a photo its trajectory must pass more than this part."""


def flown_view(block: Block) -> tuple[Block, Indices]:
    """Return what it takes to compare some photos on trajectories, nothing observed, and which these are."""
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    usable = (given_points(block) | (rays > 1))[block.image_points]
    counts = np.bincount(block.image_photos[usable], minlength=len(block.photo_ids))
    photos = spread(np.flatnonzero(timed_photos(block) & (counts >= LEAST)), MOST)
    own = np.flatnonzero(usable & np.isin(block.image_photos, photos))
    points = np.unique(block.image_points[own])
    points = points[:: max(1, len(points) // (POINTS * max(len(photos), 1)))]
    moving = timed_photos(block)[block.image_photos]
    looked = kept_images(block, np.isin(block.image_points, points) & moving)
    return looked.replace(observations=(), refraction=None), photos


def flown_misfits(block: Block, photos: Indices) -> Floats:
    """(k,) m of some photos, of all points or of given ones, whichever is larger.

    Points that are not given fit whatever the scale is. Very large where many are not seen there at all.
    """
    predicted = flown_predictions(block, photos)
    apart = np.linalg.norm(block.image_xy - predicted, axis=1)
    given = given_points(block)[block.image_points]
    found = np.full(len(photos), UNKNOWN)
    images = {photo: own for _, _, photo, own in timed_images(block)}
    for k, photo in enumerate(photos.tolist()):
        rows = images[photo]
        xy = block.image_xy[rows]
        extent = float(np.sqrt(((xy - xy.mean(axis=0)) ** 2).sum(axis=1).mean()))
        parts = [own for own in (rows, rows[given[rows]]) if len(own)]
        seen = [apart[own[np.isfinite(apart[own])]] for own in parts]
        whole = all(len(own) > SEEN * len(all_) for own, all_ in zip(seen, parts, strict=True))
        if whole and extent > 0:
            found[k] = max(float(np.sqrt((own**2).mean())) for own in seen) / extent
    return found


def flown_predictions(block: Block, photos: Indices) -> Floats:
    """(m, 2) images of some photos as they are predicted; NaN of others, and where a point is not seen."""
    places = _places(block)
    found = np.full(block.image_xy.shape, np.nan)
    wanted = set(photos.tolist())
    for own, trajectory, row, images in timed_images(block):
        if row not in wanted:
            continue
        images = images[np.isfinite(places[block.image_points[images]]).all(axis=1)]
        try:
            seen = projected(own, trajectory, camera_of(block, row), places[block.image_points[images]])
        except InputError:
            # A scanner of whose trajectory there is one record.
            continue
        found[images] = seen
    return found


def _places(block: Block) -> Floats:
    """(n, 3) points in the axes of trajectories: as they are given, or where their rays meet."""
    places = block.point_positions
    if block.spheroid is not None:
        places = geographic_to_geocentric(places, block.spheroid)
    given = given_points(block)
    if given.all():
        return places
    centres, directions = _rays(block)
    own = np.isfinite(directions).all(axis=1)
    origin = np.median(centres[own], axis=0) if own.any() else np.zeros(3)
    across = np.eye(3) - directions[own, :, np.newaxis] * directions[own, np.newaxis]
    points, count = block.image_points[own], len(places)
    normal, constant = np.zeros((count, 3, 3)), np.zeros((count, 3))
    np.add.at(normal, points, across)
    np.add.at(constant, points, np.einsum("mij,mj->mi", across, centres[own] - origin))
    return np.where(given[:, np.newaxis], places, meet(normal, constant, _counts(points, count)) + origin)


def _counts(points: Indices, count: int) -> Floats:
    return np.bincount(points, minlength=count).astype(np.float64)


def _rays(block: Block) -> tuple[Floats, Floats]:
    """(m, 3) where the rays of images come from, and their unit directions; NaN of photos at rest."""
    seen = image_directions(block)
    centres, directions = np.full(seen.shape, np.nan), np.full(seen.shape, np.nan)
    for own, trajectory, _, images in timed_images(block):
        times = np.clip(own.times(block.image_xy[images]), *trajectory.reach)
        at, turned = given_poses(trajectory, times)
        if own.sensor is not None:
            at, turned = at + turned @ own.sensor.position, turned @ own.sensor.attitude
        centres[images] = at
        directions[images] = np.einsum("mij,mj->mi", turned, seen[images])
    return centres, directions
