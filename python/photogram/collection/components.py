"""Variance components and sums over groups of collections."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.collection.collection import Collection
from photogram.results.grouping import Grouping, Observables


def collection_observables(collection: Collection) -> Observables:
    """Return what a collection has observations of: photos and points are called by their numbers."""
    photos = len(collection.photo_parameters)
    sd, point_sd = collection.photo_sd, collection.point_sd
    return Observables(
        given=collection,
        photo_cameras=np.arange(photos),
        camera_names=collection.photo_ids,
        strips=lambda: [np.arange(photos)],
        point_classes=np.where(np.isfinite(point_sd).any(axis=1), "control", "pass"),
        # The core has parameters of cameras apart; they keep their weights.
        photo_observed=(sd > 0) & np.isfinite(sd) & (np.arange(sd.shape[1]) < 6),
        stations=("rotations",) * 3 + ("translations",) * 3 + ("cameras",) * (sd.shape[1] - 6),
        commons=0,
    )


def scaled_collection(collection: Collection, grouping: Grouping, factors: Floats) -> Collection:
    """Return a collection with the variances of groups multiplied by factors."""
    roots = np.sqrt(factors)
    return collection.replace(
        image_sd=collection.image_sd * grouping.factors(roots, grouping.images),
        point_sd=collection.point_sd * grouping.factors(roots, grouping.points),
        photo_sd=collection.photo_sd * grouping.factors(roots, grouping.photos),
    )
