"""Attitudes constrained to common values by the method of modification (report, equations 104, 105)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from photogram.stellar import published, strict
from photogram.stellar.parameters import GROUPS

if TYPE_CHECKING:
    from photogram.stellar.result import Result

__all__ = ["combine", "constraints", "modify"]

Floats = NDArray[np.float64]


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


def combine(result: Result, pairs: tuple[tuple[str, str], ...]) -> Result:
    """Constrain the attitudes of the given pairs to common values, without iterating again.

    Parameters
    ----------
    result
        The solution without constraints.
    pairs
        Groups that the movement test found equal; two pairs stand for all three groups.

    Returns
    -------
    A result of its own, whose degrees of freedom count the constraints.
    """
    solved, problem = result.solved, result.problem
    c = constraints(pairs, len(solved.parameters))
    # Whole turns between two kappas are no movement.
    off = c @ solved.parameters
    misclosure = -(np.remainder(off + np.pi, 2 * np.pi) - np.pi)
    step, cofactors = modify(solved.cofactors, np.zeros(len(solved.parameters)), c, misclosure)
    parameters = solved.parameters + step
    if problem.options.as_published:
        again = published.residual_cycle(problem, parameters, solved.free, cofactors=cofactors)
    else:
        again = strict.residual_cycle(problem, parameters, solved.free, solved.places, cofactors=cofactors)
    again = replace(again, stop=solved.stop, converged=solved.converged, levels=solved.levels)
    counts = replace(result.counts, constraints=len(c))
    return replace(result, solved=again, counts=counts, pairs=pairs, movement=(), messages=())
