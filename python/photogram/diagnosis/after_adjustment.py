"""Explanations of an adjustment that failed or fits badly: mistakes in conventions, exchanged names.

Exchanged names of two points distort an adjustment by hundreds of standard deviations, or prevent
convergence. The adjusted poses are then useless. So some photos around the worst observations are oriented by
image observations alone, with a consensus that a minority cannot affect. Then names of the rejected
observations are exchanged by trial (:mod:`photogram.results.snooping_result`).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from photogram.adjustment.exchanged_names import exchanged_names
from photogram.adjustment.first_values import first_values
from photogram.arguments.types import Bools, Floats, Indices
from photogram.diagnosis.predictions import view
from photogram.diagnosis.registry import hints_at
from photogram.errors import AdjustmentError, InputError, OutOfMemoryError
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.motion import kept_images, of_photos
from photogram.results.findings import HARMFUL
from photogram.results.fixed_tests import is_suspected
from photogram.results.result import Result
from photogram.results.snooping_log import Exchange
from photogram.statistics.limits import normal_limit

if TYPE_CHECKING:
    from photogram.adjustment.first_values import FirstValues
    from photogram.diagnosis.findings import Diagnosis

BAD = 5.0  # Sigma0 above which a converged adjustment is suspect


@contextmanager
def errors_explained(block: Block | FirstValues) -> Iterator[None]:
    """Append mistakes in the data that explain a failed adjustment to its error."""
    try:
        yield
    except OutOfMemoryError:
        raise
    except AdjustmentError as error:
        from photogram.diagnosis.mistakes import Adjuster

        block = block if isinstance(block, Block) else block.usable()
        found = hints_at("data", block) or hints_at("misfit", block, Adjuster({}, (block, error)))
        error.args = ("\n".join([str(error), *(f"  hint: {hint}" for hint in found)]), *error.args[1:])
        raise


def diagnosed(result: Result) -> Result:
    """Add hints and exchanged names to a result that has not converged or fits badly.

    Mistakes in conventions (`hints`) and exchanged names (`exchanged`) enter the verdict. Hints are also
    messages.
    """
    found, said = explained(result), remarks(result)
    if found or said:
        messages = [*found, *said, *result.messages]
        result = replace(result, hints=tuple(map(str, found)), messages=messages)
    return with_exchanges(result)


def explained(result: Result) -> list[Message]:
    """Return mistakes in data conventions that explain a failed or bad adjustment."""
    if result.loss is not None:
        return []
    variance = result.variance_of_unit_weight or 0.0
    is_bad = not result.converged or variance > BAD**2
    found = hints_at("data", result.block) if is_bad else []
    if result.WHOLE and not found and (not result.converged or is_suspected(result)):
        from photogram.diagnosis.mistakes import Adjuster

        found = hints_at("misfit", result.block, Adjuster.of(result))
    return found


def remarks(result: Result) -> list[Message]:
    """Return hints on a good result: readout directions, clock offsets, fiducial marks."""
    is_special = result.converged and bool(result.unknowns or result.block.observations)
    return hints_at("fit", result) if is_special else []


def diagnosis_of(result: Result) -> Diagnosis:
    """Return the diagnosis and verdict of an adjustment that failed or fits badly."""
    from photogram.diagnosis.findings import Diagnosis, note_all, note_verdict, section_of

    found = diagnosed(result)
    section = section_of("explained")
    hints = [each for each in found.messages if str(each) in found.hints]
    note_all(section, "convention", "grave", hints)
    note_all(section, "exchanged-points", "grave", found.exchanged)
    note_all(section, "moving", "look", remarks(found))
    note_verdict(section, found.verdict)
    return Diagnosis(result.block.title, [section], found, adjusted_before=True)


CENTRES = 3  # Number of photos whose neighbourhood is examined
AROUND, SHARED = 24, 3  # Maximum number of neighbours of a photo, and minimum number of shared points
MOST_IMAGES, EACH = 4000, 40
"""Maximum number of observations of these photos, and number of points per photo if there are more.

Half of the points have the worst observations, the other half the most. Orientation with all observations
would take longer than the adjustment."""
MEDIAN_OF_LARGER = 1.05  # Median of the larger of two absolute normal variables


def with_exchanges(result: Result) -> Result:
    """Add probable exchanges of names to a result that only has gross errors."""
    block = result.block
    doubtful = result.loss is None and not result.hints and not block.mounts and not block.timed
    if not doubtful:
        return result
    found: dict[tuple[str, str], Exchange] = {}
    sizes = _sizes(result)
    for each in (pair for own in _around_worst(result, sizes) for pair in _among(result.block, own, sizes)):
        # The photos around one may not decide, and the photos around another may.
        known = found.setdefault(each.points, each)
        if len(each.photos) < len(known.photos):
            found[each.points] = each
    return replace(result, exchanged=tuple(each.probable for each in found.values())) if found else result


def _around_worst(result: Result, sizes: Floats) -> list[Indices]:
    """Return groups of photos around photos with at least two gross errors."""
    block = result.block
    bad = np.flatnonzero(sizes > 0)
    bad = bad[np.lexsort((-sizes[bad], block.image_photos[bad]))]
    photos, first, count = np.unique(block.image_photos[bad], return_index=True, return_counts=True)
    photos, second = photos[count > 1], sizes[bad[first[count > 1] + 1]]
    groups: list[Indices] = []
    for photo in photos[np.argsort(-second, kind="stable")].tolist():
        if len(groups) < CENTRES and not any(photo in group for group in groups):
            seen = np.isin(block.image_points, block.image_points[block.image_photos == photo])
            shared = np.bincount(block.image_photos[seen], minlength=len(block.photo_ids))
            order = np.argsort(-shared, kind="stable")[: AROUND + 1]
            groups.append(np.union1d([photo], order[shared[order] >= SHARED]))
    return groups


def _sizes(result: Result) -> Floats:
    """(m,) errors of observations; zero if they fit after a common scaling.

    Without convergence there are no redundancy numbers, and scaled residuals are used, which are smaller than
    test values. Observations of points that were excluded as harmful are the worst.
    """
    block, test, sizes = result.block, result.global_test, np.zeros(len(result.block.image_xy))
    if not result.converged or (test is not None and test.rejected_high):
        used = result.used_images
        relative = np.where(used, np.abs(result.residuals / block.image_sd).max(axis=1), 0.0)
        usual = float(np.median(relative[used])) / MEDIAN_OF_LARGER if used.any() else 1.0
        sizes = np.where(relative > max(usual, 1.0) * normal_limit(relative.size), relative, 0.0)
    harmful = [result.dropped.get(name) in HARMFUL for name in block.point_ids]
    return np.where(np.array(harmful)[block.image_points], np.inf, sizes)


def _among(block: Block, photos: Indices, sizes: Floats) -> list[Exchange]:
    """Return exchanged names on photos oriented by image observations alone."""
    kept = np.zeros(len(block.photo_ids), dtype=bool)
    kept[photos] = True
    part = of_photos(kept_images(block, _chosen(block, photos, sizes)), kept)
    names = ("point_positions", "photo_positions", "photo_attitudes")
    unknown = {name: np.full(getattr(part, name).shape, np.nan) for name in names}
    alone = view(part, np.arange(len(photos))).replace(spheroid=None, **unknown)
    try:
        found = first_values(alone)
    except (AdjustmentError, InputError):
        return []
    started = np.array([name in found.sources for name in found.block.photo_ids])
    images: Bools = started[found.block.image_photos]
    return exchanged_names(of_photos(found.block, started), ~found.set_aside[images])


def _chosen(block: Block, photos: Indices, sizes: Floats) -> Bools:
    """(m,) the observations that orient some photos: all, or the ones of some points."""
    own = np.isin(block.image_photos, photos)
    if np.count_nonzero(own) <= MOST_IMAGES:
        return own
    worst = np.zeros(len(block.point_ids))
    np.maximum.at(worst, block.image_points[own], sizes[own])
    rays = np.bincount(block.image_points[own], minlength=len(worst))
    points = np.zeros(len(worst), dtype=bool)
    for photo in photos.tolist():
        seen = block.image_points[block.image_photos == photo]
        for order in (np.lexsort((-rays[seen], -worst[seen])), np.argsort(-rays[seen], kind="stable")):
            points[seen[order[:EACH]]] = True
    return np.asarray(own & points[block.image_points])
