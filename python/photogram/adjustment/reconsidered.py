"""Re-evaluation of rejected images and photos with adjusted cameras, poses and points.

Initial values use cameras estimated from some images and reject images that do not fit. Once cameras are
adjusted, the rejected images are tested again, until none is reinstated. Points that an adjustment itself
excludes are re-evaluated in each of these adjustments.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.adjustment.first_features import Known
from photogram.adjustment.first_values import FirstValues, first_values
from photogram.arguments.types import Bools
from photogram.errors import AdjustmentError
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.geometry import Cartesian
from photogram.network.motion import kept_images, timed_photos
from photogram.network.rays import direction_deviations, image_directions
from photogram.results.result import Result
from photogram.words import Phrase, phrase

FITS = 10.0
"""Limit for reinstating an image, in standard deviations scaled by the median of the used images. Tests
detect smaller errors and the adjustment tolerates them; larger ones would distort it."""
MEDIAN_LENGTH = 1.1774  # Median length of a vector with two components of standard deviation 1


def adjust_started(started: FirstValues, *, by: Callable[..., Result] = adjust, **options: Any) -> Result:
    """Adjust a block from initial values, then re-evaluate the rejected observations.

    Images within ten standard deviations of the adjusted cameras, photos and points are reinstated. Missing
    photos are oriented again if possible. The block is adjusted again until nothing changes. The verdict
    lists observations that remain rejected (`Result.set_aside`).

    Parameters
    ----------
    started
        Initial values of the block (:func:`photogram.first_values`).
    by
        Function that adjusts: :func:`photogram.adjust` or :func:`photogram.adjust_in_parts`.
    options
        Options of this function.

    Raises
    ------
    InputError, AdjustmentError, RankError, OutOfMemoryError
        As in the function that adjusts.
    """
    first, result = started, by(started.usable(), **options)
    while result.converged and (started.missing or started.set_aside.any()):
        again = _judged(started, result)
        if len(again.missing) == len(started.missing) and again.set_aside.sum() == started.set_aside.sum():
            break
        more = by(again.usable(), **options)
        if not more.converged:
            break
        started, result = again, more
    return replace(result, set_aside=_named(started), messages=[*_returned(first, started), *result.messages])


def _judged(started: FirstValues, result: Result) -> FirstValues:
    """Re-evaluate rejected images and missing photos with the results of an adjustment.

    Initial values do not change, except for photos that are now oriented.
    """
    posed = np.array([photo in started.sources for photo in started.block.photo_ids])
    changes: dict[str, Any] = {"cameras": [each.camera for each in result.cameras]} if result.cameras else {}
    for name, adjusted in (("positions", result.photo_positions), ("attitudes", result.photo_attitudes)):
        changes[f"photo_{name}"] = values = getattr(started.block, f"photo_{name}").copy()
        values[posed] = adjusted
    block = started.block.replace(**changes)
    aside = started.set_aside & ~_fitting(block, started.set_aside, result)
    found = replace(started, set_aside=aside)
    try:
        again = first_values(kept_images(block, ~aside)) if started.missing else None
    except AdjustmentError:
        again = None
    if again is None:
        return found
    new = ~posed & [photo in again.sources for photo in block.photo_ids]
    rows = np.flatnonzero(~aside)
    aside[rows] = again.set_aside & new[block.image_photos[rows]]
    poses = {
        name: np.where(new[:, np.newaxis], getattr(again.block, name), getattr(started.block, name))
        for name in ("photo_positions", "photo_attitudes")
    }
    sources = {**again.sources, **started.sources}
    return replace(found, block=started.block.replace(**poses), sources=sources, missing=again.missing)


def _fitting(block: Block, aside: Bools, result: Result) -> Bools:
    """Return which images are close to the adjusted points."""
    axes = Cartesian(block.spheroid)
    known = Known.of(block, axes)
    photos, points = block.image_photos, block.image_points
    to = axes.positions(np.where(result.used_points[:, np.newaxis], result.point_positions, np.nan))[points]
    to -= known.positions[photos]
    rays = np.einsum("mij,mj->mi", known.attitudes[photos], image_directions(block))
    missed = np.linalg.norm(to / np.linalg.norm(to, axis=1, keepdims=True) - rays, axis=1)
    missed /= direction_deviations(block)
    # Images of moving photos were not rejected, and their rays do not share one pose.
    missed[timed_photos(block)[photos]] = np.nan
    usual = np.nanmedian(missed[~aside]) / MEDIAN_LENGTH
    return np.asarray(missed <= FITS * max(float(usual), 1.0))


def _named(started: FirstValues) -> tuple[Phrase, ...]:
    """List the remaining missing photos with reasons, and the rejected images."""
    block = started.block
    images = zip(
        block.image_photos[started.set_aside].tolist(),
        block.image_points[started.set_aside].tolist(),
        strict=True,
    )
    return (
        *(Phrase("named.missing", {"missing": photo, "why": why}) for photo, why in started.missing.items()),
        *(
            Phrase("named.image", {"point": block.point_ids[point], "photo": block.photo_ids[photo]})
            for photo, point in images
        ),
    )


def _returned(first: FirstValues, last: FirstValues) -> list[Message]:
    aside, missing = int(first.set_aside.sum()), len(first.missing)
    images, photos = aside - int(last.set_aside.sum()), missing - len(last.missing)
    messages = [Message(phrase("first.returned.images", n=images, all=aside))] if images > 0 else []
    return messages + ([Message(phrase("first.returned.photos", n=photos, all=missing))] if photos else [])
