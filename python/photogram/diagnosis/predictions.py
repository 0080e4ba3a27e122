"""Leave-out predictions: control compared with predictions by the others.

A prediction is the adjusted position of a free point. It contains neither the error of the point nor errors
of other free points.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.views import View
from photogram.network.block import Block
from photogram.network.rays import Rays
from photogram.results.result import Result
from photogram.statistics.likelihood import are_exchanged, judged

FEWEST = 3  # Control points needed to identify an exchanged pair


def freed(block: Block, points: Indices) -> Block:
    """Return a block in which some points are free."""
    point_sd = block.point_sd.copy()
    point_sd[points] = np.inf
    return block.replace(point_sd=point_sd)


def exchange(block: Block, one: int, other: int) -> Block:
    """Return a block with exchanged coordinates and standard deviations of two points."""
    order = np.arange(len(block.point_ids))
    order[[one, other]] = other, one
    return block.replace(point_positions=block.point_positions[order], point_sd=block.point_sd[order])


def tests_of_predictions(
    result: Result, given: Block, points: Indices, spread: float
) -> tuple[Floats, Floats]:
    """Return (k, 3) given minus predicted coordinates, and standardized values.

    `result` is an adjustment in which the points are free, and `given` is the block with their coordinates.
    `spread` is the robust standard deviation of its test values. NaN if a component is free or cannot be
    predicted.
    """
    held = np.isfinite(given.point_sd[points])
    errors = np.where(held, given.point_positions[points] - result.point_positions[points], np.nan)
    variances = given.point_sd[points] ** 2 + np.diagonal(result.point_cofactors[points], axis1=1, axis2=2)
    return errors, errors / (spread * np.sqrt(np.where(held, variances, np.nan)))


def exchanged_pair(result: Result, given: Block, points: Indices, spread: float) -> tuple[int, int] | None:
    """Return the two points that agree only with each other's predictions, or None.

    The test is :func:`are_exchanged`, without correlations between the predictions of two points. The
    parameters are described at :func:`tests_of_predictions`.
    """
    pairs = list(combinations(points.tolist(), 2))
    best: tuple[float, int, int] | None = None
    for one, other in pairs:
        own, freedom = _disagreement(result, given, [one, other], [one, other], spread)
        swapped, _ = _disagreement(result, given, [one, other], [other, one], spread)
        gain = own - swapped
        if are_exchanged(own, swapped, freedom, pairs=len(pairs)) and (best is None or gain > best[0]):
            best = gain, one, other
    return None if best is None else (best[1], best[2])


def exchanged_where_rays_meet(block: Block) -> tuple[int, int] | None:
    """Return two control points exchanged according to the initial stations, or None.

    This is for blocks that do not converge and have too few control points for predictions. Covariances of
    coarse stations are unknown. So the exchange must explain the differences of control and intersections,
    and no other exchange may do so (:func:`judged`). A common shift is allowed.
    """
    rays = Rays.of(View.of(block).seen)
    met = rays.intersect().positions
    plan = np.isfinite(block.point_sd[:, :2]).all(axis=1) & np.isfinite(met).all(axis=1)
    points = np.flatnonzero(plan)
    if len(points) < FEWEST:
        return None
    heights = rays.axes.from_local(met[points])[:, 2]
    given = block.point_positions[points].copy()
    given[:, 2] = np.where(np.isfinite(block.point_sd[points, 2]), given[:, 2], heights)
    # Squared misfit of each intersection (row) with the coordinates of each point (column).
    left = met[points, np.newaxis, :2] - rays.axes.positions(given)[np.newaxis, :, :2]
    squares = ((left - left.mean(axis=(0, 1))) ** 2).sum(axis=2)
    own = np.diag(squares)
    after = own.sum() - own[:, np.newaxis] - own + squares + squares.T
    after = after[np.triu_indices(len(points), 1)]
    verdict = judged(float(own.sum()), after.tolist(), 2 * len(points) - 2)
    if verdict is None or not verdict.accepted:
        return None
    one, other = (index[verdict.best[0]] for index in np.triu_indices(len(points), 1))
    return int(points[one]), int(points[other])


def _disagreement(
    result: Result, given: Block, coordinates: list[int], places: list[int], spread: float
) -> tuple[float, int]:
    """Return chi-square of coordinates against predictions, and its dimension."""
    total, freedom = 0.0, 0
    for point, place in zip(coordinates, places, strict=True):
        held = np.flatnonzero(np.isfinite(given.point_sd[point]))
        errors = (given.point_positions[point] - result.point_positions[place])[held]
        cofactors = result.point_cofactors[place][np.ix_(held, held)] + np.diag(
            given.point_sd[point, held] ** 2
        )
        if not np.isfinite(errors).all():
            return 0.0, 0
        total += float(errors @ np.linalg.solve(cofactors, errors)) / spread**2
        freedom += len(held)
    return total, freedom
