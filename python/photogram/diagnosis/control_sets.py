"""Control points as a set: feet, exchanged axes, and two points with exchanged coordinates.

Each proposal is compared with the given coordinates and with single wrong points.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.hypotheses import EXCHANGED, FOOT, with_coordinates
from photogram.diagnosis.mistakes import Adjuster, Explained, Proposal, View, explain, omega
from photogram.diagnosis.tested_values import mad_sd, outliers, sizes_of_tests, spread_of
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.rays import Rays, local_axes
from photogram.results.result import Result
from photogram.words import phrase

FEWEST = 3  # Control points with three components that distinguish a set from single points
FEWEST_OF_PAIRS = 3  # Control points needed to identify an exchanged pair
PAIRS = 3  # Largest number of pairs that are adjusted
MANY = 2  # Number of control points that do not fit above which the whole set is doubted

SETS: dict[str, tuple[tuple[int, ...], tuple[float, ...]]] = {
    "feet in heights": ((0, 1, 2), (1, 1, FOOT)),
    "metres in heights": ((0, 1, 2), (1, 1, 1 / FOOT)),
    "feet in X": ((0, 1, 2), (FOOT, 1, 1)),
    "feet in Y": ((0, 1, 2), (1, FOOT, 1)),
    "feet in X and Y": ((0, 1, 2), (FOOT, FOOT, 1)),
    "X and Y exchanged": (EXCHANGED, (1, 1, 1)),
}
"""Order and factors of the coordinates of all control, by mistake."""
OF_GEOGRAPHIC = ("feet in heights", "metres in heights", "X and Y exchanged")
SAME_BUT_SCALE = {"metres in heights", "feet in X and Y"}


def doubtful(first: Result | None, *kinds: str) -> bool:
    """Test whether all observations of some types may be wrong."""
    if first is None or not first.converged:
        return True
    found = outliers(first)
    beyond = sum(int(found[kind].any(axis=1).sum()) for kind in kinds if kind in found)
    size = mad_sd(first.standardized)
    fixed = "control" in kinds and bool((first.block.point_sd == 0).any())
    return beyond >= MANY or (fixed and size > MANY)


def wrong_control(block: Block, adjusted: Adjuster) -> Explained | None:
    """Return the mistake in the control as a set, or in two points, that explains the misfit, if any."""
    if not np.isfinite(block.point_sd).any() or not doubtful(adjusted.tried(block), "control"):
        return None
    proposals = [*_of_sets(block), *_of_pairs(block)]
    found = explain(block, proposals, adjusted, partial(_some_wrong, adjusted=adjusted))
    if found is None or found.best[0].points:
        return found if found is not None and found.is_certain else None
    if {each.name for each in found.best} == SAME_BUT_SCALE:
        # The hypotheses differ only in scale, which the stations determine.
        scales = [abs(math.log(_scale(each, block))) for each in found.results]
        found = replace(found, best=[found.best[int(np.argmin(scales))]])
    if np.isfinite(block.point_sd).all(axis=1).sum() < FEWEST:
        # A mistake in the set cannot be distinguished from one in some points.
        found = replace(found, judged=replace(found.judged, explained=False))
    return found


def _of_sets(block: Block) -> Iterator[Proposal]:
    for kind in SETS if block.spheroid is None else OF_GEOGRAPHIC:
        yield Proposal(kind, phrase(f"mistake.control.{kind}"), partial(intended, kind=kind))


def intended(block: Block, kind: str) -> Block:
    """Return the block with the intended control."""
    order, factors = SETS[kind]
    control = np.asarray(np.isfinite(block.point_sd).any(axis=1))
    return with_coordinates(block, "points", order, factors, control)


def _of_pairs(block: Block) -> Iterator[Proposal]:
    """Yield the exchanges of two control points that reduce their misfit to the rays most.

    Rays predict the points, except for a shift that coarse stations cause.
    """
    rays = Rays.of(View.of(block).seen)
    met = rays.intersect().positions
    plan = np.isfinite(block.point_sd[:, :2]).all(axis=1) & np.isfinite(met).all(axis=1)
    points = np.flatnonzero(plan)
    if len(points) < FEWEST_OF_PAIRS:
        return
    heights = rays.axes.from_local(met[points])[:, 2]
    given = block.point_positions[points].copy()
    given[:, 2] = np.where(np.isfinite(block.point_sd[points, 2]), given[:, 2], heights)
    # Squared misfit of each intersection (row) with the coordinates of each point (column).
    left = met[points, np.newaxis, :2] - rays.axes.positions(given)[np.newaxis, :, :2]
    squares = ((left - np.median(np.diagonal(left).T, axis=0)) ** 2).sum(axis=2)
    own = np.diag(squares)
    ones, others = np.triu_indices(len(points), 1)
    gains = own[ones] + own[others] - squares[ones, others] - squares[others, ones]
    for k in np.argsort(-gains, kind="stable")[:PAIRS].tolist():
        if gains[k] > 0:
            pair = int(points[ones[k]]), int(points[others[k]])
            names = [block.point_ids[point] for point in pair]
            message = phrase("check.exchanged-control", points=names)
            yield Proposal("exchanged", message, partial(exchange, pair=pair), points=names)


def exchange(block: Block, pair: tuple[int, int]) -> Block:
    """Return a block with exchanged coordinates and standard deviations of two points."""
    order = np.arange(len(block.point_ids))
    order[[*pair]] = pair[::-1]
    return block.replace(point_positions=block.point_positions[order], point_sd=block.point_sd[order])


def _some_wrong(block: Block, adjusted: Adjuster) -> float:
    """Return the cost of explaining the misfit by wrong points; infinite with more than a third of them.

    The point with the largest test value is excluded until all others fit. The cost is Omega of the other
    observations plus two terms. Each wrong point adds 2 ln(3 k), because it is one of k. Each of its errors
    adds 2 ln(error / standard deviation), from its prediction.
    """
    points: Indices = np.empty(0, dtype=np.int64)
    count = int(np.isfinite(block.point_sd).any(axis=1).sum())
    for _ in range(1 + max(count // 3, 1)):
        point_sd = block.point_sd.copy()
        point_sd[points] = np.inf
        result = adjusted.converged(block.replace(point_sd=point_sd) if len(points) else block)
        if result is None:
            return math.inf
        if not outliers(result)["control"].any():
            errors = np.abs(block.point_positions[points] - result.point_positions[points])
            cofactors = np.diagonal(result.point_cofactors[points], axis1=1, axis2=2)
            deviations = spread_of(result) * np.sqrt(block.point_sd[points] ** 2 + cofactors)
            sizes = np.where(np.isfinite(block.point_sd[points]), errors / deviations, 1.0)
            cost = len(points) * math.log(3 * count) + float(np.log(np.maximum(sizes, 1.0)).sum())
            return omega(result) + 2 * cost
        points = np.append(points, np.argmax(sizes_of_tests(result)["control"].max(axis=1)))
    return math.inf


def _scale(result: Result | None, block: Block) -> float:
    """Return the scale of adjusted stations: 1 for correct ones."""
    if result is None:
        return math.inf
    axes = local_axes(block)
    places: list[Floats] = [axes.positions(each) for each in (result.photo_positions, block.photo_positions)]
    sizes = [float(np.linalg.norm(each - each.mean(axis=0))) for each in places]
    return sizes[0] / sizes[1]
