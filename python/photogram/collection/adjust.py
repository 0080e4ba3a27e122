"""Adjustment of a collection."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress, core_options, core_threads, teller
from photogram.adjustment.options import AdjustOptions, Ordering
from photogram.adjustment.remarks import hardly_determined, harmful_points, hidden, rounded
from photogram.adjustment.robust import Loss, remark
from photogram.arguments.arrays import by_key, truth_value
from photogram.collection.result import AdjustedCollection, collection_network, named
from photogram.lazy_dataclasses import replace
from photogram.messages import Message, Undetermined
from photogram.network.core_arrays import CoreOptions
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.collection import Collection


WORSE = 100.0  # Limit of the standard deviations of a weak photo, relative to the median of all photos


def adjust(
    collection: Collection,
    *,
    tolerance: float | None = None,
    max_iterations: int = 200,
    loss: Loss | None = None,
    covariance: bool = True,
    ordering: Ordering = "auto",
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> AdjustedCollection:
    """Adjust a collection by Levenberg-Marquardt steps from approximate values.

    Points with a free coordinate and images on one photo only are excluded. Points that converge to the
    station of a photo, because inconsistent rays meet there, are excluded as well, as they would ruin the
    numerical precision. Such points are a hundred times nearer than others. In every other photo, the images
    of point and station agree within three standard deviations, before and after a step. Points that diverge
    to infinity on parallel or divergent rays are also excluded. Photos without remaining images do not
    change. If weighted or fixed values define no datum, cofactors refer to minimum constraints: position and
    attitude of the first photo, and one translation component of another. Residuals, redundancy numbers and
    the variance of unit weight are independent of this choice.

    Parameters
    ----------
    collection
        Collection with its initial values.
    tolerance
        Iterate until a step decreases the objective function by less than this fraction. None: 1e-8 without a
        loss, and 1e-6 with one, because reweighting converges linearly.
    max_iterations
        Maximum number of iterations (accepted steps).
    loss
        Robust loss: `huber` or `cauchy`, of both coordinates of an image point together. None: least squares.
        `("huber", 2.0)` also specifies the scale; see :func:`photogram.adjust`.
    covariance
        Whether to compute covariances, redundancy numbers and standardized residuals.
    ordering
        Elimination order of photos; see :func:`photogram.adjust`.
    threads
        Number of threads; see :func:`photogram.adjust`.
    progress
        Called with the progress from time to time; an exception that it raises stops the adjustment.

    Returns
    -------
    The result. Its `status` is `converged` if the adjustment converged; `messages` explain missing
    covariances.

    Raises
    ------
    RankError
        If damping does not help, because an unknown is not observed.
    AdjustmentError
        If there is nothing to adjust, initial values give infinite image coordinates, or double precision is
        insufficient for large values; lists the photos and points concerned.
    InputError
        If an option is invalid.
    KeyboardInterrupt
        If interrupted by Ctrl-C.
    """
    truth_value("covariance", covariance)
    if tolerance is None:
        tolerance = 1e-8 if loss is None else 1e-6
    chosen = AdjustOptions(
        loss=loss,
        covariance=covariance,
        tolerance=tolerance,
        max_iterations=max_iterations,
        ordering=ordering,
    )
    options = replace(core_options(chosen), criterion="decrease", points_given=True)
    return adjusted(collection, options, threads=threads, progress=progress)


def adjusted(
    collection: Collection,
    options: CoreOptions,
    *,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    start: _photocore.BlockState | None = None,
) -> AdjustedCollection:
    """Adjust a collection from its initial values or from a former state."""
    try:
        network = collection_network(collection, options)
        told = None if progress is None else teller(progress)
        solution = network.adjust(threads=core_threads(threads), progress=told, start=start)
    except _photocore.CollectionError as error:
        raise named(*error.args) from None
    return AdjustedCollection.taken_over(
        solution,
        collection=collection,
        messages=_messages(solution, collection) + remark(options.loss, solution.image_weights),
        loss=options.loss,
        weighted_sum_of_squares=solution.sum_of_squares,
        datum=[(photo, collection.parameters[parameter]) for photo, parameter in solution.datum],
        options=options,
        state=solution.state,
    )


def _messages(solution: _photocore.CollectionSolution, collection: Collection) -> list[Message]:
    messages: list[Message] = []
    if solution.undetermined is not None:
        error = named(*solution.undetermined)
        messages.append(Undetermined(phrase("collection.no-covariances", error=str(error)), what=str(error)))
    # A distant point on parallel rays converges slowly; it is reported separately.
    if solution.weak and not solution.weak_points:
        weak = sorted(solution.weak, key=lambda pair: pair[1])
        unknowns = [
            str(phrase("collection.weak-unknowns", parameter=collection.parameters[unknown], names=names))
            for unknown, names in by_key((unknown, str(photo)) for photo, unknown in weak).items()
        ]
        messages.append(hardly_determined(solution.status, "; ".join(unknowns)))
    messages += rounded(solution.redundancy_excess)
    numbers = [str(point) for point in range(len(collection.point_positions))] if solution.weak_points else []
    messages += harmful_points(solution.weak_points, numbers) + _hardly_held(solution)
    alone = solution.photo_images == 0
    given = np.bincount(collection.image_photos, minlength=len(alone)) > 0
    single = solution.point_rays == 0
    excluded = {
        "points-collapsed": solution.collapsed,
        "points-at-stations": solution.beside_stations,
        "points-not-determined": solution.not_determined,
    }
    for points in excluded.values():
        single[points] = False
    numbers_of: dict[str, Any] = {
        "photos-without-images": np.flatnonzero(alone & ~given),
        "photos-undetermined": np.flatnonzero(alone & given),
        **excluded,
        "points-with-one-ray": np.flatnonzero(single),
    }
    messages += [
        Message.of(f"collection.{code}", names=list(map(str, numbers)))
        for code, numbers in numbers_of.items()
        if len(numbers)
    ]
    behind = solution.point_rays_behind
    messages += hidden(int(behind.sum()), [str(point) for point in np.flatnonzero(behind)], [])
    if solution.datum:
        fixed = [
            phrase("collection.parameter", parameter=collection.parameters[parameter], photo=photo)
            for photo, parameter in solution.datum
        ]
        messages.append(Message.of("collection.datum", parameters=fixed))
    return messages


@np.errstate(all="ignore")
def _hardly_held(solution: _photocore.CollectionSolution) -> list[Message]:
    """Report photos that are much weaker than others, e.g. with collinear points."""
    variances = np.diagonal(solution.photo_cofactors, axis1=1, axis2=2)
    sd = np.sqrt(np.where(variances > 0, variances, np.nan))
    free = np.isfinite(sd).any(axis=0)
    if not free.any():
        return []
    ratio = np.nan_to_num(sd[:, free] / np.nanmedian(sd[:, free], axis=0)).max(axis=1)
    names = [str(photo) for photo in np.flatnonzero(ratio > WORSE)]
    return [Message.of("collection.weak-photos", names=names, ratio=float(ratio.max()))] if names else []
