"""The observations of a collection as groups that may hold a gross error together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Indices
from photogram.collection.collection import POSE, Collection
from photogram.collection.core import CollectionOptions, collection_network
from photogram.results.network_trial import (
    ATTITUDE,
    CONTROL,
    IMAGE,
    KINDS,
    POSITION,
    NamedSuspects,
    NetworkTrial,
)

__all__ = ["collection_trial"]

ROUGH, EXACT = 1e-7, 1e-12
"""A step that lowers the sum of squares by less than this share ends a round; where R of all rows is used."""


def collection_trial(
    collection: Collection,
    options: CollectionOptions,
    state: _photocore.BlockState,
    threads: int = 0,
    *,
    parts: bool = True,
) -> NetworkTrial:
    """Return a collection as snooping asks it, from where an adjustment of it has ended."""
    core = collection_network(collection, options).trial(state, threads=threads)
    return NetworkTrial(
        core=core,
        suspects=_Named(collection, core, parts).suspects(),
        supported=np.asarray(np.isfinite(collection.photo_sd).all(axis=1)),
        rough=ROUGH,
        exact=EXACT,
    )


class _Named(NamedSuspects):
    """What the groups of observations of a collection are called: photos and points have numbers."""

    def __init__(self, collection: Collection, core: _photocore.NetworkTrial, parts: bool) -> None:
        super().__init__(core, collection.image_points, collection.image_photos, apart=parts)
        self.collection = collection

    def other_loads(self, kind: int, subject: int) -> Indices:
        """Return the photo whose camera it is."""
        return np.array([subject])

    def photo_name(self, photo: int) -> str:
        """Return what a photo is called."""
        return f"photo {photo}"

    def parts(self, group: int) -> Sequence[Sequence[int]] | None:
        """Return the rows that may go alone: of control single ones or all, of a station single ones."""
        size = int(self.starts[group + 1] - self.starts[group])
        if not self.apart or int(self.kinds[group]) == IMAGE or size < 2:
            return None
        single = [(row,) for row in range(size)]
        return [*single, tuple(range(size))] if int(self.kinds[group]) == CONTROL else single

    def name(self, group: int) -> str:
        """Return what a group is called."""
        kind, subject = int(self.kinds[group]), int(self.subjects[group])
        if kind == IMAGE:
            point, photo = self.collection.image_points[subject], self.collection.image_photos[subject]
            return f"image of point {point} on photo {photo}"
        if kind == CONTROL:
            return f"control point {subject}"
        return f"{KINDS[kind]} of photo {subject}"

    def row_name(self, row: int) -> str:
        """Return what a row is."""
        group, component = self.group_of(row), int(self.components[row])
        kind = int(self.kinds[group])
        if kind == IMAGE:
            return "xy"[component]
        if kind == CONTROL:
            return "XYZ"[component]
        names = {POSITION: POSE[3:], ATTITUDE: POSE[:3]}.get(kind, self.collection.parameters[6:])
        return str(names[component])

    def unit(self, row: int) -> str:
        """Return the unit of a row."""
        kind = int(self.kinds[self.group_of(row)])
        return {IMAGE: "px", ATTITUDE: "rad"}.get(kind, "")
