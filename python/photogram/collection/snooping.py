"""Data snooping of a collection: gross errors found one after the other and taken out."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress, core_threads
from photogram.adjustment.snooping import of_network, settings_of
from photogram.arguments.arrays import one_of, truth_value
from photogram.arguments.types import Indices
from photogram.collection.adjust import adjust
from photogram.collection.adjusted import AdjustedCollection
from photogram.collection.collection import Collection
from photogram.collection.suspects import collection_trial
from photogram.errors import AdjustmentError
from photogram.messages import Message
from photogram.results.network_trial import ATTITUDE, CONTROL, IMAGE, POSITION, NetworkTrial
from photogram.results.snooped import Snooped
from photogram.statistics.distributions import LEVEL
from photogram.statistics.snooping.snooping import snooped
from photogram.statistics.snooping.suspects import LostSupportError, Out

__all__ = ["snoop_collection"]


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
    tried = dataclasses.replace(first.options, covariance=True, loss=None)
    trial = collection_trial(collection, tried, first.state, core_threads(threads), parts=parts)
    try:
        outcome = snooped(trial, settings)
    except (LostSupportError, _photocore.CollectionError) as error:
        raise AdjustmentError(f"the collection cannot be tested: {error.args[0]}") from error
    cleaned = _without(first, trial, outcome.out)
    result = adjust(cleaned, threads=threads, progress=progress, **options)
    remarks = [Message(remark) for remark in outcome.remarks]
    result = dataclasses.replace(result, messages=[*remarks, *result.messages])
    return Snooped(result=result, outcome=outcome, suspects=trial.suspects, settings=settings)


def _without(first: AdjustedCollection, trial: NetworkTrial, out: Out) -> Collection:
    """Return a collection without what is out; what is free starts at adjusted values."""
    given, core = first.collection, trial.core
    parameters, points = first.photo_parameters.copy(), core.points
    for own, values in zip(parameters, core.photos, strict=True):
        own[: len(values)] = values
    points = np.where(np.isnan(points), given.point_positions, points)
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
        photo_parameters=np.where(np.isinf(photo_sd), parameters, given.photo_parameters),
        point_positions=np.where(np.isinf(point_sd), points, given.point_positions),
        photo_sd=photo_sd,
        point_sd=point_sd,
        image_photos=given.image_photos[images],
        image_points=given.image_points[images],
        image_xy=given.image_xy[images],
        image_sd=given.image_sd[images],
    )
