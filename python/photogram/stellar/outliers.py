"""Images and stars of a plate that contradict the rest, by name."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import listed
from photogram.statistics.limits import externally_studentized, normal_limit, studentized_limit
from photogram.stellar.parameters import INDEX, NAMES
from photogram.stellar.problem import Problem
from photogram.stellar.state import Solved

if TYPE_CHECKING:
    from photogram.stellar import Result

__all__ = ["Tests", "culprits", "harm", "outliers", "studentized"]


_TESTABLE = 0.01
"""Redundancy numbers below this test nothing."""
_HELPS = 10.0
"""By how much the sum of squares falls when what spoils a solution is left out."""
_ROUNDS = 10
"""Solutions at most when outliers are left out, each without what is half as far off as the farthest."""
_SUSPECTS = 12
"""Stars that are left out one after the other to find what spoils a solution."""


@dataclass(frozen=True, eq=False)
class Tests:
    """Test values of all observations, and what good ones rarely exceed."""

    images: Floats  # (m, 2) and (S, 2) absolute values; NaN where nothing is tested
    stars: Floats
    limit: float  # Good observations of the whole plate stay below it with 95 %
    # Whether the mean error of unit weight is known (option 14): residuals over their mean errors; else
    # externally studentized ones
    known: bool


def studentized(result: Result) -> Tests:
    """Return the test values of plate coordinates and catalogue places."""
    solved, given = result.solved, result.problem.options.mean_error
    tested = [
        np.where(redundancy > _TESTABLE, values, np.nan)
        for redundancy, values in (
            (solved.redundancy, solved.standardized),
            (solved.star_redundancy, solved.star_standardized),
        )
    ]
    number = sum(int(np.isfinite(values).sum()) for values in tested)
    if given:
        images, stars = (np.abs(values) / given for values in tested)
        return Tests(images, stars, normal_limit(number), True)
    freedom, total = result.degrees_of_freedom, sum(solved.sums)
    images, stars = (np.abs(externally_studentized(values, total, freedom)) for values in tested)
    return Tests(images, stars, studentized_limit(freedom, number), False)


def outliers(result: Result) -> list[str]:
    """Name plate points and stars that contradict the rest, the worst first."""
    problem, tests = result.problem, studentized(result)
    names = [
        f"point {point} of star {problem.star_ids[star]}"
        for point, star in zip(problem.image_points, problem.image_stars, strict=True)
    ]
    found = _named(tests.images, names, tests.limit)
    found += _named(tests.stars, [f"the place of star {star}" for star in problem.star_ids], tests.limit)
    found.sort(reverse=True)
    if not found:
        return []
    kind = "of their mean errors" if tests.known else "externally studentized"
    return [
        f"outliers (residuals {kind}, limit {tests.limit:.2f}): "
        + listed([f"{name} ({value:.3g})" for value, name in found])
    ]


def harm(result: Result, iterate: Callable[[Problem], Result]) -> str:
    """Say which parameter of the camera outliers change by more than it is uncertain without them.

    Nothing where there are none, where they do no harm, or where the rest does not determine the camera.

    Parameters
    ----------
    result
        A solution that has converged.
    iterate
        Solves a problem.
    """
    clean = result
    for _ in range(_ROUNDS):
        tests = studentized(clean)
        images, stars = (np.nan_to_num(each).max(axis=1, initial=0.0) for each in (tests.images, tests.stars))
        far = max(tests.limit, 0.5 * max(images.max(initial=0.0), stars.max(initial=0.0)))
        if not ((images > far).any() or (stars > far).any()):
            break
        try:
            clean = iterate(clean.problem.without(stars > far, images > far))
        except AdjustmentError:
            return ""
        if not clean.converged:
            return ""
    sd = np.sqrt(np.diag(clean.covariance))
    camera = np.flatnonzero(clean.solved.free & (sd > 0) & (np.arange(len(sd)) >= INDEX["epsilon"]))
    change = np.abs(result.solved.parameters - clean.solved.parameters)[camera] / sd[camera]
    if not change.size or change.max() <= 1.0:
        return ""
    name = NAMES[camera[int(change.argmax())]]
    return f"outliers change {name} by {change.max():.3g} of the standard deviations that it has without them"


def _named(values: Floats, names: list[str], limit: float) -> list[tuple[float, str]]:
    largest = np.nan_to_num(values).max(axis=1, initial=0.0)
    return [(float(largest[i]), names[i]) for i in np.flatnonzero(largest > limit)]


def culprits(problem: Problem, solved: Solved | None, iterate: Callable[[Problem], Solved]) -> list[str]:
    """Name the star without which a solution that has not converged does.

    Parameters
    ----------
    problem
        The plate.
    solved
        Where the iteration stopped; None where there is nothing.
    iterate
        Solves a problem.
    """
    stars = len(problem.star_ids)
    before = math.inf if solved is None else sum(solved.sums)
    found: list[tuple[float, str]] = []
    for star in _suspects(problem, solved):
        others = np.arange(stars) == star
        left = problem.without(others, np.zeros(len(problem.image_points), bool))
        try:
            again = iterate(left)
        except AdjustmentError:
            continue
        if again.converged and _HELPS * sum(again.sums) < before:
            found.append((sum(again.sums), problem.star_ids[star]))
    if not found:
        return []
    _, name = min(found)
    return [f"without star {name} the solution converges: it, or one of its images, is wrong"]


def _suspects(problem: Problem, solved: Solved | None) -> list[int]:
    """Return the stars whose images have the largest residuals."""
    size = np.zeros(len(problem.star_ids))
    if solved is not None:
        weighted = np.einsum("mi,mij,mj->m", solved.residuals, problem.image_weights, solved.residuals)
        np.maximum.at(size, problem.image_stars, np.nan_to_num(weighted))
        own = problem.known & ~problem.held
        off = solved.places - problem.star_places
        size[own] += np.nan_to_num(np.einsum("si,sij,sj->s", off[own], problem.star_weights[own], off[own]))
    return [int(star) for star in np.argsort(-size, kind="stable")[:_SUSPECTS]]
