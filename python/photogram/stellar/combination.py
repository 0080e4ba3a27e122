"""Attitudes constrained to common values: as published by the method of modification (equations 104, 105)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.stellar import report_iteration, strict
from photogram.stellar.parameters import GROUPS, NAMES

if TYPE_CHECKING:
    from photogram.stellar.problem import Problem
    from photogram.stellar.result import Result
    from photogram.stellar.state import Solved

__all__ = ["combine", "constraints", "modify"]


def constraints(pairs: tuple[tuple[str, str], ...], parameters: int) -> Floats:
    """Return C: three rows for one pair, six for more (pre - event, post - event)."""
    pairs = pairs if len(pairs) == 1 else (("pre", "event"), ("post", "event"))
    rows = np.zeros((3 * len(pairs), parameters))
    for p, (first, second) in enumerate(pairs):
        for k in range(3):
            rows[3 * p + k, 3 * GROUPS.index(first) + k] = 1.0
            rows[3 * p + k, 3 * GROUPS.index(second) + k] = -1.0
    return rows


def modify(cofactors: Floats, right: Floats, c: Floats, misclosure: Floats) -> tuple[Floats, Floats]:
    """Return corrections and cofactors under constraints C x = misclosure (equations 104 and 105).

    Parameters
    ----------
    cofactors
        (n, n) inverse of the normal matrix without constraints.
    right
        (n,) right-hand side of the normal equations.
    c
        (k, n) constraints.
    misclosure
        (k,) what C times the corrections has to be.
    """
    across = cofactors @ c.T
    gain = np.linalg.solve(c @ across, across.T).T
    step = cofactors @ right
    return step + gain @ (misclosure - c @ step), cofactors - gain @ across.T


def combine(result: Result, pairs: tuple[tuple[str, str], ...], *, threads: int | None = None) -> Result:
    """Constrain the attitudes of the given pairs to common values.

    As published by one linear step, without iterating again; else iterated, with one attitude for the groups.

    Parameters
    ----------
    result
        The solution without constraints.
    pairs
        Groups that the movement test found equal; two pairs stand for all three groups.
    threads
        Number of threads; all processors when None.

    Returns
    -------
    A result of its own, whose degrees of freedom count the constraints.
    """
    counts = replace(result.counts, constraints=len(constraints(pairs, len(NAMES))))
    made = (
        _modified(result, pairs) if result.problem.options.as_published else _iterated(result, pairs, threads)
    )
    return replace(result, solved=made, counts=counts, pairs=pairs, movement=(), messages=())


def _modified(result: Result, pairs: tuple[tuple[str, str], ...]) -> Solved:
    """Correct once (equations 104 and 105), and compute residuals."""
    solved, problem = result.solved, result.problem
    c = constraints(pairs, len(solved.parameters))
    # Whole turns between two kappas are no movement.
    off = c @ solved.parameters
    misclosure = -(np.remainder(off + np.pi, 2 * np.pi) - np.pi)
    step, cofactors = modify(solved.cofactors, np.zeros(len(solved.parameters)), c, misclosure)
    parameters = solved.parameters + step
    return report_iteration.residual_cycle(
        problem,
        parameters,
        solved.free,
        cofactors=cofactors,
        log_determinant=solved.log_determinant,
        stop=solved.stop,
        converged=solved.converged,
        levels=solved.levels,
    )


def _iterated(result: Result, pairs: tuple[tuple[str, str], ...], threads: int | None) -> Solved:
    """Adjust again with one attitude for the groups of the pairs, and give it to all of them."""
    solved, problem = result.solved, result.problem
    together = sorted({GROUPS.index(name) for pair in pairs for name in pair})
    last = together[-1]
    groups = np.array([last if group in together else group for group in range(3)])
    # All parameters from those that are left.
    spread = np.eye(len(NAMES))
    for group in together[:-1]:
        spread[3 * group : 3 * group + 3] = spread[3 * last : 3 * last + 3]
    weights, initial = _common_weights(problem, spread, solved.parameters)
    merged = replace(
        problem,
        image_groups=groups[problem.image_groups],
        axis=problem.axis and replace(problem.axis, group=int(groups[problem.axis.group])),
        parameter_weights=weights,
        initial=initial,
    )
    free = solved.free & (spread.any(axis=0))
    again = strict.iterate(
        merged,
        solved.parameters,
        free,
        solution="combined",
        limit=problem.options.max_iterations,
        threads=threads,
    )
    # Of what weights of several groups say, the common values keep their distance to each.
    off, axis = spread @ again.parameters - problem.initial, again.axis_residual
    weighted = float(off @ problem.parameter_weights @ off)
    if problem.axis is not None and axis is not None:
        weighted += float(axis @ problem.axis.weight @ axis)
    return replace(
        again,
        parameters=spread @ again.parameters,
        free=solved.free,
        cofactors=spread @ again.cofactors @ spread.T,
        sums=(again.sums[0], again.sums[1], weighted),
    )


def _common_weights(problem: Problem, spread: Floats, near: Floats) -> tuple[Floats, Floats]:
    """Return weights and weighted values of the parameters that are left: those of groups together add up."""
    weights = spread.T @ problem.parameter_weights @ spread
    if not problem.weighted[:9].any():
        return weights, problem.initial
    initial = problem.initial.copy()
    # Whole turns between two angles are no difference.
    initial[:9] += 2 * np.pi * np.round(((spread @ near)[:9] - initial[:9]) / (2 * np.pi))
    weighted = np.flatnonzero(np.diag(weights) > 0)
    right = spread.T @ problem.parameter_weights @ initial
    values = initial.copy()
    values[weighted] = np.linalg.solve(weights[np.ix_(weighted, weighted)], right[weighted])
    return weights, values
