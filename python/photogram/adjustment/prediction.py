"""Prediction of the covariances of a planned block from geometry and weights.

Covariances and redundancy numbers depend on positions and weights, not on measured values. A network can
therefore be assessed before the flight (GIANT guide, introduction: with a fictitious data
generator "a user may predict results before using a set of photographs").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from photogram.adjustment.adjustment import Progress, adjust
from photogram.adjustment.options import Ordering
from photogram.adjustment.remarks import named_images
from photogram.arguments.types import Floats
from photogram.errors import AdjustmentError, InputError
from photogram.messages import Message
from photogram.network import geometry
from photogram.network.block import Block, checked, of_images_alone, refuse_trajectories
from photogram.network.cameras import images_of
from photogram.network.motion import image_rows, on_shared, timed_photos
from photogram.network.observations import Attitude, Position, Rate, Smoothness, Velocity
from photogram.network.projecting import projected_images
from photogram.results.result import Result
from photogram.words import phrase

_OF_POSES = (Attitude, Position, Rate, Velocity)
_AGREES = 1e-3  # Maximum deviation of a trajectory observation, in standard deviations


def predict(
    block: Block,
    *,
    ordering: Ordering = "auto",
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Result:
    """Predict covariances and redundancy numbers at given positions and attitudes.

    The image coordinates of the block are not used. They are computed from the given values, so that the
    adjustment is a single linearization. Incidences and standard deviations are taken from the block. The
    variance of unit weight is 1.

    Parameters
    ----------
    block
        The planned block. Every point with images needs three coordinates; standard deviations define the
        control. Photos may be on trajectories, with given poses and observations that must agree with them,
        e.g. the truth of :func:`photogram.simulate`.
    ordering, threads, progress
        As in :func:`photogram.adjust`.

    Returns
    -------
    Positions equal the given ones except for rounding. Use cofactors and covariances only; residuals are
    meaningless.

    Raises
    ------
    InputError
        If a point with images is without coordinates, behind a photo, or out of its view; lists these points.
        If there are additional observations other than of trajectories, or they contradict the given values.
    RankError
        If the network does not determine all unknowns; lists the photos and points concerned.
    AdjustmentError
        If there is nothing to adjust, or rays are too parallel to intersect.
    """
    _check_positions(_check_observations(checked(block)))
    result = adjust(
        block.replace(
            image_xy=computed_images(block), photo_positions_observed=None, photo_attitudes_observed=None
        ),
        unit_variance="unity",
        ordering=ordering,
        threads=threads,
        progress=progress,
    )
    if not result.converged:
        raise AdjustmentError(phrase("predict.not-converged", status=result.status))
    # Residuals of observations that contradict the given values do not belong to the network.
    for kind in result.kinds.values():
        tests = np.abs(kind.residuals / kind.sd)
        if (tests > _AGREES).any():
            name, times = kind.names[int(np.argwhere(tests > _AGREES)[0][0])], float(tests.max())
            raise InputError(phrase("predict.disagrees", kind=kind.kind, name=name, times=times))
    return replace(result, messages=[Message(phrase("predict.computed")), *result.messages])


def computed_images(block: Block) -> Floats:
    """Compute (m, 2) image coordinates from the given values of a block."""
    if not block.timed:
        return _frame_images(block)
    moving = timed_photos(block)[block.image_photos][:, np.newaxis]
    return np.where(moving, projected_images(block), _frame_images(block))


def _frame_images(block: Block) -> Floats:
    photos, points = block.image_photos, block.image_points
    distances = block.principal_distances
    ideal = geometry.project(
        block.point_positions[points],
        block.photo_positions[photos],
        block.photo_attitudes[photos],
        np.full(len(photos), -1.0) if distances is None else distances[photos],
        spheroid=block.spheroid,
        photo_to_ground=block.photo_to_ground,
        refraction=block.refraction,
        linear_unit=block.linear_unit,
    )
    if block.photo_cameras is None:
        return ideal
    # With principal distance -1, an image is the direction (u1, u2) / -u3 of a point in front.
    directions = np.column_stack([ideal, np.full(len(ideal), -1.0)])
    return images_of(block.cameras, block.photo_cameras[photos], directions)


def at_adjusted(result: Result) -> Block:
    """Return the block of an adjustment with adjusted values as given, for :func:`predict`.

    Images of excluded points are removed. AdjustmentError if the adjustment has not converged; InputError for
    photos on trajectories.
    """
    if not result.converged:
        raise AdjustmentError(phrase("predict.not-converged", status=result.status))
    block, used = result.block, result.used_images
    refuse_trajectories(block, "the plan of an adjusted block")
    return block.replace(
        photo_positions=result.photo_positions,
        photo_attitudes=result.photo_attitudes,
        photo_positions_observed=None,
        photo_attitudes_observed=None,
        cameras=[each.camera for each in result.cameras],
        point_positions=np.where(
            result.used_points[:, np.newaxis], result.point_positions, block.point_positions
        ),
        **image_rows(block, used),
    )


def image_depths(block: Block) -> Floats:
    """Return (m,) distances of image points in front of the planes of their photos.

    The unit is the linear unit, along the axes of the photos; scale is distance / principal distance. Photos
    on given trajectories have approximate positions.
    """
    points, photos = block.point_positions, block.photo_positions
    directions = geometry.viewing_directions(
        photos, block.photo_attitudes, spheroid=block.spheroid, photo_to_ground=block.photo_to_ground
    )
    if block.spheroid is not None:
        points = geometry.geographic_to_geocentric(points, block.spheroid)
        photos = geometry.geographic_to_geocentric(photos, block.spheroid)
    rays = points[block.image_points] - photos[block.image_photos]
    return np.asarray(np.einsum("mi,mi->m", rays, directions[block.image_photos]))


def _check_observations(block: Block) -> Block:
    """Reject observations other than of trajectories, and photos on frames."""
    if not block.timed:
        return of_images_alone(block, "predict")
    if block.mounts:
        raise InputError(phrase("block.unsupported.mounts", what="predict"))
    moving = {each.photo for each in block.timed}
    for each in block.observations:
        photos = each.photos
        of_motion = each.moment is not None or isinstance(each, Smoothness)
        if not (of_motion or (isinstance(each, _OF_POSES) and moving.issuperset(photos))):
            raise InputError(phrase("predict.observation", kind=each.KIND, name=each.name))
    return block


def _check_positions(block: Block) -> None:
    """Reject points with unknown positions or behind a photo (not detected by collinearity)."""

    def refuse(code: str, images: Any) -> None:
        if images.any():
            raise InputError(phrase(code, **named_images(block, images)))

    refuse("predict.unknown", np.isnan(block.point_positions[block.image_points]).any(axis=1))
    if block.timed:
        refuse("predict.unseen", ~np.isfinite(computed_images(block)).all(axis=1))
    refuse("predict.behind", ~(image_depths(block) > 0) & ~on_shared(block)[block.image_photos])
