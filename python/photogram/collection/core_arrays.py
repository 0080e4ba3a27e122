"""A collection as the core takes it."""

from __future__ import annotations

from photogram import _photocore
from photogram.collection.collection import Collection
from photogram.memory import available_memory
from photogram.network.core_arrays import CoreOptions, core_network

__all__ = ["collection_network"]


@core_network.register
def collection_network(given: Collection, options: CoreOptions) -> _photocore.CollectionNetwork:
    """Return a collection as the core adjusts it, and answers questions about it afterwards."""
    return _photocore.collection_network(
        given.camera,
        given.photo_parameters,
        given.photo_sd,
        given.point_positions,
        given.point_sd,
        given.image_photos,
        given.image_points,
        given.image_xy,
        given.image_sd,
        decrease=options.limit,
        max_iterations=options.max_iterations,
        covariance=options.covariance,
        loss=options.loss,
        ordering=options.ordering,
        memory=available_memory(),
    )
