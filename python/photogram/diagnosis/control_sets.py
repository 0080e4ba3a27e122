"""Control points as a set: feet, and exchanged axes.

The block is adjusted with the intended coordinates of each hypothesis. Its weighted sum of squares is
compared with that of the given coordinates, of single wrong points, and of two exchanged points.
"""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.diagnosis.adjusting import Adjuster
from photogram.diagnosis.blunders import without_outlying_control
from photogram.diagnosis.exchanges import exchange, likely_pairs
from photogram.diagnosis.findings import Explained, likely
from photogram.diagnosis.hypotheses import FOOT
from photogram.diagnosis.robust import mad_sd
from photogram.diagnosis.tested_values import outliers
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.rays import local_axes
from photogram.results.result import Result
from photogram.statistics.likelihood import judged
from photogram.words import phrase

FEWEST = 3  # Control points with three components that distinguish a set from single points
CLEARLY = 2 * math.log(20)  # Additional cost of an explanation by single points (likelihood ratio of 20)
MANY = 2  # Number of control points that do not fit above which the whole set is doubted

FACTORS = {
    "feet in heights": (1, 1, FOOT),
    "metres in heights": (1, 1, 1 / FOOT),
    "feet in X": (FOOT, 1, 1),
    "feet in Y": (1, FOOT, 1),
    "feet in X and Y": (FOOT, FOOT, 1),
}
"""Hypotheses about all control; in geographic space only those on heights, and exchanged axes."""
OF_HEIGHTS = ("feet in heights", "metres in heights")
EXCHANGED = "X and Y exchanged"
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


def intended(block: Block, kind: str) -> Block:
    """Return the block with the intended control."""
    order, factors = ([1, 0, 2], (1, 1, 1)) if kind == EXCHANGED else ([0, 1, 2], FACTORS[kind])
    held = np.isfinite(block.point_sd).any(axis=1, keepdims=True)
    positions = np.where(held, block.point_positions[:, order] * factors, block.point_positions)
    return block.replace(point_positions=positions, point_sd=block.point_sd[:, order])


def explain(block: Block, adjusted: Adjuster) -> Explained | None:
    """Return the mistake in the control as a set that explains the misfit, if any."""
    full = np.isfinite(block.point_sd).all(axis=1)
    kinds = [*FACTORS, EXCHANGED] if block.spheroid is None else [*OF_HEIGHTS, EXCHANGED]
    blocks = [intended(block, kind) for kind in kinds]
    results = [adjusted.converged(each) for each in blocks]
    changed, given = [*map(_omega, results)], _omega(adjusted.converged(block))
    freedom = next((each.degrees_of_freedom for each in results if each is not None), 0)
    if freedom < 1:
        return None
    pairs = [exchange(block, *pair) for pair in likely_pairs(block, None)]
    single = min([_some_wrong(block, adjusted), *(_omega(adjusted.converged(each)) for each in pairs)])
    verdict = judged(_finite(given, changed), changed, freedom, known_weight=True)
    if verdict is None or min(changed) + CLEARLY > single:
        # Other wrong points hide a mistake in the set: both are compared with the cost of wrong points.
        changed = [min(own, _some_wrong(each, adjusted)) for own, each in zip(changed, blocks, strict=True)]
        verdict = judged(_finite(min(single, given), changed), changed, freedom, known_weight=True)
        if verdict is None:
            return None
    best = [kinds[place] for place in verdict.best]
    if {*best} == SAME_BUT_SCALE:
        # The hypotheses differ only in scale, which the stations determine.
        best = [min(best, key=lambda each: abs(math.log(_scale(results[kinds.index(each)], block))))]
        verdict = replace(verdict, best=verdict.best[:1])
    if full.sum() < FEWEST:
        # A mistake in the set cannot be distinguished from one in some points.
        verdict = replace(verdict, explained=False)
    causes = [phrase(f"mistake.control.{each}") for each in best]
    effect = phrase("mistake.control-misfit", times=verdict.fall)
    return Explained(best[0], likely(causes, effect), verdict, lambda own: intended(own, best[0]))


def _finite(given: float, changed: list[float]) -> float:
    """Return Omega of the given data, worse than all others if there is no adjustment."""
    return min(given, 1e6 * max((each for each in changed if math.isfinite(each)), default=1.0))


def _omega(result: Result | None) -> float:
    return math.inf if result is None else result.sums_of_squares.total


def _some_wrong(block: Block, adjusted: Adjuster) -> float:
    """Return the cost of explaining the misfit by wrong points.

    The cost is Omega of the other observations plus two terms. Each wrong point adds 2 ln(3 k), because it is
    one of k. Each of its errors adds 2 ln(error / standard deviation).
    """
    found = without_outlying_control(block, adjusted)
    if found is None:
        return math.inf
    result, tests = found
    count = int(np.isfinite(block.point_sd).any(axis=1).sum())
    sizes = np.log(np.maximum(np.nan_to_num(tests), 1.0)).sum()
    return _omega(result) + 2 * (len(tests) * math.log(3 * count) + float(sizes))


def _scale(result: Result | None, block: Block) -> float:
    """Return the scale of adjusted stations: 1 for correct ones."""
    if result is None:
        return math.inf
    axes = local_axes(block)
    places: list[Floats] = [axes.positions(each) for each in (result.photo_positions, block.photo_positions)]
    sizes = [float(np.linalg.norm(each - each.mean(axis=0))) for each in places]
    return sizes[0] / sizes[1]
