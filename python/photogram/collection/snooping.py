"""Data snooping of a collection, and the check of its equivalent block."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress, core_threads
from photogram.adjustment.exchanged_names import exchanged_names
from photogram.adjustment.robust import LossName, loss_row
from photogram.adjustment.snooping import finished, gone, used_images
from photogram.arguments.arrays import one_of
from photogram.arguments.types import Floats, Indices
from photogram.collection.adjust import adjust, adjusted
from photogram.collection.findings import collection_held
from photogram.collection.parameters import POSE
from photogram.collection.result import AdjustedCollection, collection_trial
from photogram.diagnosis.diagnose import check_block
from photogram.diagnosis.findings import Diagnosis, Section
from photogram.errors import AdjustmentError
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.core_arrays import CoreOptions
from photogram.network.motion import image_rows
from photogram.results.network_trial import ATTITUDE, CONTROL, POSITION, LostSupportError, NetworkTrial, Out
from photogram.results.snooping_log import Aside, Outcome, snooped
from photogram.results.snooping_options import SnoopOptions
from photogram.results.snooping_result import Snooped
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.collection import Collection

MEDIAN_OF_TWO = 1.1774100225154747  # Median of the length of a vector of two standard normal variables
LOSSES: tuple[LossName, ...] = ("huber", "cauchy")
FAR = 5.0  # Initial rejection limit of images after a robust adjustment, in robust standard deviations
BY_LOSSES = "a robust adjustment of the given values (Huber, then Cauchy)"


def snoop_collection(
    collection: Collection,
    options: SnoopOptions,
    *,
    threads: int | None,
    progress: Callable[[Progress], None] | None,
    unit_variance: str = "constrained",
    **changes: Any,
) -> Snooped:
    """Remove gross errors from a collection; see :func:`photogram.snoop`."""
    one_of("unit_variance", unit_variance, ("constrained",))

    def tried(covariance: bool) -> tuple[AdjustedCollection, NetworkTrial, Outcome]:
        first = adjust(collection, covariance=covariance, threads=threads, progress=progress, **changes)
        trial_at = partial(collection_trial, collection, first.options, threads=core_threads(threads))
        trial = trial_at(first.state, parts=options.parts)

        def afresh() -> Aside | None:
            found = started_robustly(collection, first.options, threads=threads)
            if found is None:
                return None
            state, images = found
            trial.restart(trial_at(state).core)
            return Aside(images, {}, BY_LOSSES)

        return first, trial, snooped(trial, options, afresh)

    try:
        first, trial, outcome = tried(False)
    except (LostSupportError, _photocore.CollectionError):
        # Covariances show which observations must be removed because they are undetermined.
        try:
            first, trial, outcome = tried(True)
        except (LostSupportError, _photocore.CollectionError) as error:
            raise AdjustmentError(phrase("collection.no-trial", error=error.args[0])) from error
    cleaned = _without(first, trial, outcome.out)
    result = adjust(cleaned, threads=threads, progress=progress, **changes)
    placed = as_block(collection.replace(photo_parameters=result.photo_parameters))
    used = used_images(trial, outcome.out, len(collection.image_xy))
    # Constants of a camera are not fixed parameters in this sense.
    fixed = collection.photo_sd == 0
    fixed[:, len(POSE) :] &= ~fixed[:, len(POSE) :].all(axis=0)
    any_held = bool(fixed.any() or (collection.point_sd == 0).any())
    return finished(
        result,
        trial,
        outcome,
        options,
        held=lambda: collection_held(adjust(collection, **changes)) if any_held else [],
        exchanged=exchanged_names(placed, used, max(result.variance_of_unit_weight or 1.0, 1.0)),
    )


def started_robustly(
    collection: Collection, options: CoreOptions, *, threads: int | None
) -> tuple[_photocore.BlockState, Indices] | None:
    """Adjust a collection robustly; return the final state and the images far from it.

    Cameras are unknown, so that resection cannot detect wrong images. Huber's loss limits the effect of each
    image on the photos, and Cauchy's loss then releases the inconsistent ones.
    """
    state: _photocore.BlockState | None = None
    sizes: Floats = np.zeros(0)
    for loss in LOSSES:
        own = dataclasses.replace(options, covariance=False, loss=loss_row(loss))
        try:
            found = adjusted(collection, own, threads=threads, start=state)
        except AdjustmentError:
            return None
        state = found.state
        sizes = np.linalg.norm(found.residuals / collection.image_sd, axis=1)
        sizes = np.where(found.used_images, sizes, np.nan)
    if state is None or not np.isfinite(sizes).any():
        return None
    far = FAR * max(float(np.nanmedian(sizes)) / MEDIAN_OF_TWO, 1.0)
    images: Indices = np.flatnonzero(sizes > far)
    return (state, images) if len(images) else None


def _without(first: AdjustedCollection, trial: NetworkTrial, out: Out) -> Collection:
    """Return a collection without removed observations; free values start at adjusted ones."""
    given, core = first.collection, trial.core
    parameters, points = first.photo_parameters.copy(), core.points
    for own, values in zip(parameters, core.photos, strict=True):
        own[: len(values)] = values
    points = np.where(np.isnan(points), given.point_positions, points)
    images = used_images(trial, out, len(given.image_xy))
    point_sd, photo_sd = given.point_sd.copy(), given.photo_sd.copy()
    point_sd[gone(trial, out, CONTROL)] = np.inf
    for kind, shift in ((POSITION, 3), (ATTITUDE, 0)):
        photos, own = gone(trial, out, kind)
        photo_sd[photos, own + shift] = np.inf
    return given.replace(
        photo_parameters=np.where(np.isinf(photo_sd), parameters, given.photo_parameters),
        point_positions=np.where(np.isinf(point_sd), points, given.point_positions),
        photo_sd=photo_sd,
        point_sd=point_sd,
        **image_rows(given, images),
    )


def check(network: Collection, threads: int | None) -> Diagnosis:
    """Check a collection as a block, from the result of a robust adjustment."""
    section = Section("Start", "Values of a collection may be far off: a robust adjustment comes first.")
    try:
        adjusted = adjust(network, loss="huber", covariance=False, threads=threads)
        network = network.replace(
            photo_parameters=adjusted.photo_parameters, point_positions=adjusted.point_positions
        )
        section.figure("robust adjustment", adjusted.status)
    except AdjustmentError as error:
        section.remark("collection.no-robust-start", error=error)
    sections, result = check_block(as_block(network), {"threads": threads})
    return Diagnosis("", [section, *sections], result)


def as_block(collection: Collection) -> Block:
    """Convert a collection to a block: one camera per photo, points at ray intersections.

    Positions and attitudes are fixed if all their components are; other weights are ignored.
    """
    poses = collection.photo_parameters[:, : len(POSE)]
    attitudes = Attitudes.of("rotation_vector_to_photo", poses[:, :3])
    centres = -np.einsum("pij,pj->pi", attitudes.matrices, poses[:, 3:])
    fixed = (collection.photo_sd[:, : len(POSE)] == 0).all(axis=1)[:, np.newaxis]
    sd = np.broadcast_to(np.where(fixed, 0.0, math.inf), (len(poses), 3))
    names = collection.parameters[len(POSE) :]
    held = np.isfinite(collection.point_sd)
    return Block(
        photo_ids=[f"photo {number}" for number in range(len(poses))],
        photo_positions=centres,
        photo_attitudes=attitudes.values("omega_phi_kappa"),
        photo_position_sd=sd,
        photo_attitude_sd=sd,
        cameras=[
            Camera(
                collection.camera,
                dict(zip(names, values, strict=True)),
                sd={name: one for name, one in zip(names, own, strict=True) if one > 0},
                unit="px",
            )
            for values, own in zip(
                collection.photo_parameters[:, len(POSE) :].tolist(),
                collection.photo_sd[:, len(POSE) :].tolist(),
                strict=True,
            )
        ],
        point_ids=[f"point {number}" for number in range(len(collection.point_positions))],
        point_positions=np.where(held, collection.point_positions, np.nan),
        point_sd=collection.point_sd,
        image_photos=collection.image_photos,
        image_points=collection.image_points,
        image_xy=collection.image_xy,
        image_sd=collection.image_sd,
    )
