"""Conversion of a collection to the core, trials for tests, and messages for core failures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.adjustment.remarks import too_coarse
from photogram.collection.parameters import POSE
from photogram.errors import AdjustmentError, InputError, RankError, failure_of_core
from photogram.memory import available_memory
from photogram.network.core_arrays import CoreOptions
from photogram.results.network_trial import KINDS, NamedSuspects, NetworkTrial
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.collection import Collection

ROUGH, EXACT = 1e-7, 1e-12  # Relative decrease of the sum of squares that ends a round; EXACT with full R


def collection_network(given: Collection, options: CoreOptions) -> _photocore.CollectionNetwork:
    """Create the core network that adjusts a collection and evaluates it afterwards."""
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


def named(
    kind: str,
    message: str,
    combinations: list[_photocore.CombinationRow],
    points: list[int],
    _seconds: list[float],
) -> AdjustmentError | InputError:
    """Convert a core failure to an error; photos and points are numbered from 0."""
    if kind == "undetermined points":
        names = [str(point) for point in points]
        text = phrase("collection.undetermined-points", n=len(names), names=names)
        return RankError(text, [], names)
    if kind == "undetermined photos":
        names = [str(photo) for photo in sorted({photo for each in combinations for photo in each[0]})]
        text = phrase("collection.undetermined-photos", n=len(combinations), names=names)
        return RankError(text, names, [])
    if kind == "coarse":
        return too_coarse([str(photo) for photo in combinations[0][0]], [str(point) for point in points])
    if kind == "left out":
        return InputError(phrase("collection.point-excluded", point=points[0]))
    return failure_of_core(kind, message)


def collection_trial(
    collection: Collection, core: _photocore.NetworkTrial, *, parts: bool = True
) -> NetworkTrial:
    """Create the trial of a collection for tests."""
    return NetworkTrial(
        core=core,
        suspects=_Named(collection, core.suspects),
        supported=np.asarray(np.isfinite(collection.photo_sd).all(axis=1)),
        rough=ROUGH,
        exact=EXACT,
        control="components" if parts else "whole",
    )


class _Named(NamedSuspects):
    def __init__(self, collection: Collection, core: _photocore.NetworkSuspects) -> None:
        components = ("XYZ", POSE[3:], POSE[:3])
        super().__init__(collection, core, components=components, lengths=("",) * 3)
        self.parameters = collection.parameters[len(POSE) :]

    def other_name(self, kind: int, subject: int) -> Phrase:
        return Phrase(f"named.photo_{KINDS[kind]}", {"photo": str(self.given.photo_ids[subject])})

    def other_row(self, kind: int, subject: int, component: int) -> tuple[str, str]:
        """Return the name of a camera parameter, without a unit."""
        return self.parameters[component], ""
