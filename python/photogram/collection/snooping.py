"""Data snooping of a collection: gross errors found one after the other and taken out."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress, core_threads
from photogram.adjustment.snooping import of_network, settings_of
from photogram.arguments.arrays import one_of, truth_value
from photogram.arguments.types import Indices
from photogram.collection.adjust import adjust
from photogram.collection.adjusted import AdjustedCollection
from photogram.collection.collection import POSE, Collection
from photogram.collection.core import collection_network
from photogram.errors import AdjustmentError
from photogram.messages import Message
from photogram.results.network_trial import (
    ATTITUDE,
    CONTROL,
    IMAGE,
    KINDS,
    OBSERVATION,
    POSITION,
    NetworkTrial,
    image_loads,
)
from photogram.results.snooped import Snooped
from photogram.statistics.distributions import LEVEL
from photogram.statistics.snooping.snooping import snooped
from photogram.statistics.snooping.suspects import LostSupportError, Out, Suspects

__all__ = ["collection_trial", "snoop_collection"]

ROUGH, EXACT = 1e-7, 1e-12
"""A step that lowers the sum of squares by less than this share ends a round; where R of all rows is used."""


@of_network.register
def snoop_collection(
    collection: Collection,
    *,
    unit_variance: str = "constrained",
    level: float = LEVEL,
    fdr: float | None = None,
    unit_weight: str = "known",
    robust: bool | None = None,
    parts: bool = True,
    max_rounds: int = 20,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    **options: Any,
) -> Snooped:
    """Take gross errors out of a collection: `photogram.snoop` with the options of its adjustment."""
    one_of("unit_variance", unit_variance, ("constrained",))
    truth_value("parts", parts)
    settings = settings_of(level, fdr, unit_weight, robust, max_rounds)
    first = adjust(collection, covariance=False, threads=threads, progress=progress, **options)
    trial = collection_trial(first, threads, parts=parts)
    try:
        outcome = snooped(trial, settings)
    except (LostSupportError, _photocore.CollectionError) as error:
        raise AdjustmentError(f"the collection cannot be tested: {error.args[0]}") from error
    cleaned = _without(first, trial, outcome.out)
    result = adjust(cleaned, threads=threads, progress=progress, **options)
    remarks = [Message(remark) for remark in outcome.remarks]
    result = dataclasses.replace(result, messages=[*remarks, *result.messages])
    return Snooped(result=result, outcome=outcome, suspects=trial.suspects, settings=settings)


def collection_trial(
    result: AdjustedCollection, threads: int | None = None, *, parts: bool = True
) -> NetworkTrial:
    """Return an adjusted collection as snooping asks it."""
    collection = result.collection
    options = dataclasses.replace(result.options, covariance=True, loss=None)
    core = collection_network(collection, options).trial(result.state, threads=core_threads(threads))
    return NetworkTrial(
        core=core,
        suspects=_Named(collection, core, parts).suspects(),
        supported=np.asarray(np.isfinite(collection.photo_sd).all(axis=1)),
        rough=ROUGH,
        exact=EXACT,
    )


def _without(first: AdjustedCollection, trial: NetworkTrial, out: Out) -> Collection:
    """Return a collection without what is out; what is free starts at adjusted values."""
    given, adjusted, core = first.collection, first.adjusted(), trial.core
    kinds, subjects = core.subjects
    starts, components = core.row_starts, core.components
    group = np.repeat(np.arange(len(kinds)), np.diff(starts))
    subject = subjects[group]

    def gone(kind: int) -> tuple[Indices, Indices]:
        rows = out.rows & (kinds[group] == kind)
        return subject[rows], components[rows]

    images = np.ones(len(given.image_xy), dtype=bool)
    images[gone(IMAGE)[0]] = False
    point_sd, photo_sd = given.point_sd.copy(), given.photo_sd.copy()
    point_sd[gone(CONTROL)] = np.inf
    for kind, shift in ((POSITION, 3), (ATTITUDE, 0)):
        photos, own = gone(kind)
        photo_sd[photos, own + shift] = np.inf
    return given.replace(
        photo_parameters=np.where(np.isinf(photo_sd), adjusted.photo_parameters, given.photo_parameters),
        point_positions=np.where(np.isinf(point_sd), adjusted.point_positions, given.point_positions),
        photo_sd=photo_sd,
        point_sd=point_sd,
        image_photos=given.image_photos[images],
        image_points=given.image_points[images],
        image_xy=given.image_xy[images],
        image_sd=given.image_sd[images],
    )


class _Named:
    """What the groups of observations of a collection are called: photos and points have numbers."""

    def __init__(self, collection: Collection, core: _photocore.NetworkTrial, parts: bool) -> None:
        self.collection, self.apart = collection, parts
        self.kinds, self.subjects = core.subjects
        self.starts, self.components = core.row_starts, core.components
        self.photos_of_point = image_loads(collection.image_points, collection.image_photos)

    def suspects(self) -> Suspects:
        kinds, subjects, collection = self.kinds, self.subjects, self.collection
        points, photos = np.full(len(kinds), -1), np.full(len(kinds), -1)
        image, control = kinds == IMAGE, kinds == CONTROL
        points[image] = collection.image_points[subjects[image]]
        photos[image] = collection.image_photos[subjects[image]]
        points[control] = subjects[control]
        station = (kinds == POSITION) | (kinds == ATTITUDE)
        photos[station] = subjects[station]
        return Suspects(
            row_starts=self.starts,
            kinds=kinds.astype(np.int64),
            kind_names=KINDS,
            points=points,
            photos=photos,
            loads=self.loads,
            removable=np.asarray(kinds <= OBSERVATION),
            parts=self.parts,
            name=self.name,
            row_name=self.row_name,
            unit=self.unit,
            photo_name=self.photo_name,
        )

    def photo_name(self, photo: int) -> str:
        """Return what a photo is called."""
        return f"photo {photo}"

    def loads(self, group: int) -> Indices:
        kind, subject = int(self.kinds[group]), int(self.subjects[group])
        if kind == IMAGE:
            return self.photos_of_point(int(self.collection.image_points[subject]))
        if kind == CONTROL:
            return self.photos_of_point(subject)
        return np.array([subject])

    def parts(self, group: int) -> Sequence[Sequence[int]] | None:
        size = int(self.starts[group + 1] - self.starts[group])
        if not self.apart or int(self.kinds[group]) == IMAGE or size < 2:
            return None
        single = [(row,) for row in range(size)]
        return [*single, tuple(range(size))] if int(self.kinds[group]) == CONTROL else single

    def name(self, group: int) -> str:
        kind, subject = int(self.kinds[group]), int(self.subjects[group])
        if kind == IMAGE:
            point, photo = self.collection.image_points[subject], self.collection.image_photos[subject]
            return f"image of point {point} on photo {photo}"
        if kind == CONTROL:
            return f"control point {subject}"
        return f"{KINDS[kind]} of photo {subject}"

    def row_name(self, row: int) -> str:
        group, component = int(np.searchsorted(self.starts, row, "right")) - 1, int(self.components[row])
        kind = int(self.kinds[group])
        if kind == IMAGE:
            return "xy"[component]
        if kind == CONTROL:
            return "XYZ"[component]
        names = {POSITION: POSE[3:], ATTITUDE: POSE[:3]}.get(kind, self.collection.parameters[6:])
        return str(names[component])

    def unit(self, row: int) -> str:
        kind = int(self.kinds[int(np.searchsorted(self.starts, row, "right")) - 1])
        return {IMAGE: "px", ATTITUDE: "rad"}.get(kind, "")
