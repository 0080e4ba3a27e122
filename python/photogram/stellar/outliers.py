"""Outlying stars and images of a plate, and their effect on the camera."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from photogram.errors import AdjustmentError
from photogram.stellar.findings import plate_tests
from photogram.stellar.parameters import INDEX, NAMES
from photogram.stellar.problem import Problem
from photogram.stellar.state import Solved
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.stellar import Result

_FALL = 10.0  # Least reduction ratio of the sum of squares by removal of a faulty star
_MAX_ROUNDS = 10
_MAX_SUSPECTS = 12


def outliers(result: Result) -> list[Phrase]:
    """Return a warning on the outliers of the verdict, worst first, or an empty list."""
    found = [
        (float(abs(tested.values[place])), tested.name(place))
        for tested in plate_tests(result)
        for place in result.verdict.outlying.get(tested.kind, ())
    ]
    if not found:
        return []
    found.sort(key=lambda item: -item[0])
    names = [phrase("stars.outlier", name=name, value=value) for value, name in found]
    fields = result.verdict.outliers[0].fields
    return [phrase("stars.outliers", statistic=fields["statistic"], limit=fields["limit"], names=names)]


def harm(result: Result, iterate: Callable[[Problem], Result]) -> Phrase | None:
    """Return the largest parameter change by outliers, in sd without them, or None.

    Rounds reject outliers that are at least half as large as the worst, and adjust again. None for a change
    below one, or if the remaining observations do not determine the camera.
    """
    clean = result
    for _ in range(_MAX_ROUNDS):
        tests, outlying = plate_tests(clean), clean.verdict.outlying
        if not any(outlying.values()):
            break
        sizes = [np.nan_to_num(np.abs(tested.values)).max(axis=1, initial=0.0) for tested in tests]
        half = 0.5 * max(values.max(initial=0.0) for values in sizes)
        images, stars = (np.zeros(len(values), bool) for values in sizes)
        for tested, rows, values in zip(tests, (images, stars), sizes, strict=True):
            rows[[place[0] for place in outlying.get(tested.kind, ())]] = True
            rows &= values > half
        try:
            clean = iterate(clean.problem.without(stars, images))
        except AdjustmentError:
            return None
        if not clean.converged:
            return None
    sd = np.sqrt(np.diag(clean.covariance))
    camera = np.flatnonzero(clean.solved.free & (sd > 0) & (np.arange(len(sd)) >= INDEX["epsilon"]))
    change = np.abs(result.solved.parameters - clean.solved.parameters)[camera] / sd[camera]
    if not change.size or change.max() <= 1.0:
        return None
    return phrase("stars.harm", name=NAMES[camera[int(change.argmax())]], change=float(change.max()))


def culprits(problem: Problem, solved: Solved, iterate: Callable[[Problem], Solved]) -> list[Phrase]:
    """Return a warning on the star whose removal makes the solution converge."""
    before = sum(solved.sums)
    best, culprit = math.inf, ""
    for star in _suspects(problem, solved):
        others = np.arange(len(problem.star_ids)) == star
        try:
            again = iterate(problem.without(others, np.zeros(len(problem.image_points), bool)))
        except AdjustmentError:
            continue
        total = sum(again.sums)
        if again.converged and _FALL * total < before and total < best:
            best, culprit = total, problem.star_ids[star]
    return [phrase("stars.culprit", star=culprit)] if culprit else []


def _suspects(problem: Problem, solved: Solved) -> list[int]:
    size = np.zeros(len(problem.star_ids))
    weighted = np.einsum("mi,mij,mj->m", solved.residuals, problem.image_weights, solved.residuals)
    np.maximum.at(size, problem.image_stars, np.nan_to_num(weighted))
    observed = problem.known & ~problem.held
    off = (solved.places - problem.star_places)[observed]
    size[observed] += np.nan_to_num(np.einsum("si,sij,sj->s", off, problem.star_weights[observed], off))
    return [int(star) for star in np.argsort(-size, kind="stable")[:_MAX_SUSPECTS]]
