"""Tests for the verdict on an adjusted collection; fixed values have score tests, as in blocks."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.collection.parameters import POSE
from photogram.results.findings import network_findings
from photogram.results.fixed_tests import SUSPECTED, Held, held_tests
from photogram.results.patterns import CameraImages, patterns
from photogram.statistics.findings import Findings, Tested
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.collection import AdjustedCollection

FIRST_OF_TRANSLATION = 3
STEP = 1e-6  # Step of numerical derivatives, relative to the parameter or 1
POINTS = 3  # Coordinates of a point, whose partial derivatives follow those by photos


def collection_findings(result: AdjustedCollection) -> Findings:
    """Return the tests of a collection.

    Given standard deviations of pixels are guesses, so observations are tested relative to each other.
    """
    together = CameraImages("the cameras", np.ones(len(result.photo_parameters), dtype=bool), 0)
    return replace(
        network_findings(result, collection_held(result), patterns(result, [together])),
        check=Phrase("how.check.collection"),
        take_out=Phrase("advice.snoop-collection"),
        if_usable=[Phrase("advice.no-datum")] if result.datum else [],
    )


def collection_held(result: AdjustedCollection) -> list[Tested]:
    """Return tests of fixed parameters and points with the largest residuals."""
    return held_tests(result, lambda of_images: _suspected(result, of_images), lambda: _partials(result))


def _suspected(result: AdjustedCollection, of_images: Floats) -> list[Held]:
    """Return fixed values with the largest residuals, in descending order."""
    collection, used = result.collection, result.used_images
    rows: list[tuple[float, Held]] = []

    def add(name: Phrase, own: Indices, which: int, partials: Indices) -> None:
        images = np.flatnonzero(used & (own == which))
        if len(images):
            worst = float(of_images[images].mean())
            rows.append((worst, Held(name, images, partials)))

    for photo in _worst(collection.image_photos, of_images, (collection.photo_sd == 0).any(axis=1)):
        held = np.flatnonzero(collection.photo_sd[photo] == 0)
        for what, part in (
            ("rotation", held[held < FIRST_OF_TRANSLATION]),
            ("translation", held[(held >= FIRST_OF_TRANSLATION) & (held < len(POSE))]),
            ("photo_camera", held[held >= len(POSE)]),
        ):
            if len(part):
                add(Phrase(f"named.{what}", {"photo": str(photo)}), collection.image_photos, photo, part)
    width = collection.photo_parameters.shape[1]
    for point in _worst(collection.image_points, of_images, (collection.point_sd == 0).all(axis=1)):
        name = Phrase("named.control", {"point": str(point)})
        add(name, collection.image_points, point, width + np.arange(POINTS))
    rows.sort(key=lambda row: -row[0])
    return [each for _, each in rows[: 3 * SUSPECTED]]


def _worst(own: Indices, of_images: Floats, held: Bools) -> list[int]:
    """Return fixed photos or points with the largest residuals, in descending order."""
    counts = np.bincount(own, minlength=len(held))
    mean = np.bincount(own, of_images, len(held)) / np.maximum(counts, 1)
    rows = np.flatnonzero(held & (counts > 0))
    return [int(row) for row in rows[np.argsort(-mean[rows], kind="stable")][:SUSPECTED]]


def _partials(result: AdjustedCollection) -> Floats:
    """Return (k + 3, m, 2) partial derivatives of images by photo parameters and coordinates."""
    collection = result.collection
    photos = result.photo_parameters[collection.image_photos]
    points = result.point_positions[collection.image_points]
    found = np.full((photos.shape[1] + POINTS, len(photos), 2), np.nan)
    seen = np.flatnonzero(result.used_images)
    values, width = np.hstack([photos[seen], points[seen]]), photos.shape[1]
    steps = STEP * np.maximum(np.abs(values), 1.0)
    steps[:, width:] = STEP * np.median(np.abs(points[seen]))

    def images(moved: Floats) -> Floats:
        parts = map(np.ascontiguousarray, (moved[:, :width], moved[:, width:]))
        return _photocore.collection_images(collection.camera, *parts)

    for k, step in enumerate(steps.T):
        moved = np.outer(step, np.arange(len(found)) == k)
        found[k, seen] = (images(values + moved) - images(values - moved)) / (2 * step[:, np.newaxis])
    return found
