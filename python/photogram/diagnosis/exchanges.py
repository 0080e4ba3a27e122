"""Control points with exchanged coordinates, by prediction, then by adjustment.

Rays predict the points, except for a shift that coarse stations cause. The pairs whose exchange reduces the
misfit most are adjusted with exchanged coordinates, and their likelihoods decide.
"""

from __future__ import annotations

import numpy as np

from photogram.diagnosis.adjusting import Adjuster, Proposal, best_of
from photogram.diagnosis.views import View
from photogram.network.block import Block
from photogram.network.rays import Rays
from photogram.results.result import Result
from photogram.words import phrase

FEWEST = 3  # Control points needed to identify an exchanged pair
PAIRS = 3  # Largest number of pairs that are adjusted


def exchange(block: Block, one: int, other: int) -> Block:
    """Return a block with exchanged coordinates and standard deviations of two points."""
    order = np.arange(len(block.point_ids))
    order[[one, other]] = other, one
    return block.replace(point_positions=block.point_positions[order], point_sd=block.point_sd[order])


def exchanged_control(block: Block, result: Result | None, adjusted: Adjuster) -> tuple[str, str] | None:
    """Return two control points whose exchange explains the misfit of an adjustment, or None.

    `result` is the adjustment of the block with the given coordinates; None if it failed.
    """
    tried = [
        Proposal(
            phrase("check.exchanged-control", points=[block.point_ids[point] for point in pair]),
            exchange(block, *pair),
        )
        for pair in likely_pairs(block, result)
    ]
    found = best_of(result, tried, adjusted) if tried else None
    if found is None:
        return None
    one, other = found[0].mistake.fields["points"]
    return one, other


def likely_pairs(block: Block, result: Result | None) -> list[tuple[int, int]]:
    """Return the pairs of control points whose exchange reduces their misfit to the rays most."""
    seen = View.of(block).seen
    if result is not None and result.converged and len(result.photo_positions) == len(seen.photo_ids):
        seen = seen.replace(photo_positions=result.photo_positions, photo_attitudes=result.photo_attitudes)
    rays = Rays.of(seen)
    met = rays.intersect().positions
    plan = np.isfinite(block.point_sd[:, :2]).all(axis=1) & np.isfinite(met).all(axis=1)
    points = np.flatnonzero(plan)
    if len(points) < FEWEST:
        return []
    heights = rays.axes.from_local(met[points])[:, 2]
    given = block.point_positions[points].copy()
    given[:, 2] = np.where(np.isfinite(block.point_sd[points, 2]), given[:, 2], heights)
    # Squared misfit of each intersection (row) with the coordinates of each point (column).
    left = met[points, np.newaxis, :2] - rays.axes.positions(given)[np.newaxis, :, :2]
    squares = ((left - np.median(np.diagonal(left).T, axis=0)) ** 2).sum(axis=2)
    own = np.diag(squares)
    ones, others = np.triu_indices(len(points), 1)
    gains = own[ones] + own[others] - squares[ones, others] - squares[others, ones]
    order = np.argsort(-gains, kind="stable")[:PAIRS]
    return [(int(points[ones[k]]), int(points[others[k]])) for k in order.tolist() if gains[k] > 0]
