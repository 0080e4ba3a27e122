"""Variance components and sums over groups of collections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogram import _photocore
from photogram.adjustment.components import Weighing, scaled, weighing
from photogram.arguments.types import Floats
from photogram.collection.adjust import adjusted
from photogram.collection.adjusted import AdjustedCollection
from photogram.collection.collection import Collection
from photogram.collection.core import CollectionOptions, collection_network
from photogram.results.group_sums import factored, observables
from photogram.results.grouping import Grouping, Observables

__all__: list[str] = []

DECREASE = 1e-12
"""Part of the sum of squares by which steps still lower it: components want adjustments that are sharp."""
_OPTIONS = CollectionOptions(DECREASE, 200, covariance=True, loss=None, ordering="auto")


@observables.register
def collection_observables(collection: Collection) -> Observables:
    """Return what a collection has observations of: photos and points are called by their numbers."""
    photos = len(collection.photo_parameters)
    sd, point_sd = collection.photo_sd, collection.point_sd
    names = [str(photo) for photo in range(photos)]
    return Observables(
        image_photos=collection.image_photos,
        image_points=collection.image_points,
        photo_names=names,
        photo_cameras=np.arange(photos),
        camera_names=names,
        strips=lambda: [np.arange(photos)],
        point_classes=np.where(np.isfinite(point_sd).any(axis=1), "control", "pass"),
        point_observed=(point_sd > 0) & np.isfinite(point_sd),
        # The core has parameters of cameras apart; they keep their weights.
        photo_observed=(sd > 0) & np.isfinite(sd) & (np.arange(sd.shape[1]) < 6),
        stations=("rotations",) * 3 + ("translations",) * 3 + ("cameras",) * (sd.shape[1] - 6),
        observations=[],
        commons=0,
        cameras=photos,
    )


@observables.register
def _(result: AdjustedCollection) -> Observables:
    return collection_observables(result.collection)


@factored.register
def _(result: AdjustedCollection) -> _photocore.BlockCovariances:
    options = replace(_OPTIONS, ordering=result.ordering, loss=result.loss)
    network = collection_network(result.collection, options)
    return network.covariances(result.state, threads=0, progress=None)


@scaled.register
def scaled_collection(collection: Collection, grouping: Grouping, factors: Floats) -> Collection:
    """Return a collection with the variances of groups multiplied by factors."""
    roots = np.sqrt(factors)
    return collection.replace(
        image_sd=collection.image_sd * grouping.factors(roots, grouping.images),
        point_sd=collection.point_sd * grouping.factors(roots, grouping.points),
        photo_sd=collection.photo_sd * grouping.factors(roots, grouping.photos),
    )


class _Collection(Weighing):
    result: AdjustedCollection

    def __init__(self, collection: Collection, threads: int | None) -> None:
        self.given = self.network = collection
        self.threads = threads
        self.result = self.first = adjusted(collection, _OPTIONS, threads=threads)

    def adjust(self, grouping: Grouping, factors: Floats) -> AdjustedCollection:
        self.network = scaled_collection(self.given, grouping, factors)
        self.result = adjusted(self.network, _OPTIONS, threads=self.threads, start=self.result.state)
        return self.result

    def total(self) -> tuple[float, float]:
        return float(self.result.degrees_of_freedom), self.result.weighted_sum_of_squares

    def factored(self) -> _photocore.BlockCovariances:
        return factored(self.result)


@weighing.register
def _(network: Collection, *, threads: int | None, tolerance: float) -> Weighing:
    del tolerance
    return _Collection(network, threads)
