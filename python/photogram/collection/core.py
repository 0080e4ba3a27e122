"""A collection as the core takes it."""

from __future__ import annotations

from dataclasses import dataclass

from photogram import _photocore
from photogram.collection.collection import Collection
from photogram.memory import available_memory

__all__ = ["CollectionOptions", "collection_network"]


@dataclass(frozen=True)
class CollectionOptions:
    """How the core adjusts a collection: the options of `photogram.collection.adjust` as it knows them."""

    decrease: float
    max_iterations: int
    covariance: bool
    loss: tuple[str, float] | None
    ordering: str


def collection_network(collection: Collection, options: CollectionOptions) -> _photocore.CollectionNetwork:
    """Return a collection as the core adjusts it, and answers questions about it afterwards."""
    return _photocore.collection_network(
        collection.camera,
        collection.photo_parameters,
        collection.photo_sd,
        collection.point_positions,
        collection.point_sd,
        collection.image_photos,
        collection.image_points,
        collection.image_xy,
        collection.image_sd,
        decrease=options.decrease,
        max_iterations=options.max_iterations,
        covariance=options.covariance,
        loss=options.loss,
        ordering=options.ordering,
        memory=available_memory(),
    )
