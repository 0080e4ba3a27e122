"""Agreement of check points with an adjustment that did not use them.

Differences d (adjusted minus given) of n points have the covariance C = s^2 Q + S. Q are the joint cofactors
of the adjusted points, including cross blocks, because these share the errors of the block. S is the
covariance of the given values. T = d' C^-1 d is chi-square with as many degrees of freedom as values (Baarda
1968). T / m is F(m, f) if s^2 is estimated with f degrees of freedom and s^2 Q is most of C.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.statistics.distributions import LEVEL
from photogram.statistics.findings import Agreement, Tested
from photogram.statistics.limits import global_test
from photogram.words import Phrase

SINGULAR = 1e-12  # Least relative variance of a direction
BORDER = 2.0 / SINGULAR  # Exceeds T over the squares of scaled differences if C is regular


def agreement(
    differences: Floats,
    cofactors: Floats,
    given: Floats,
    *,
    scale: float = 1.0,
    second: float = math.inf,
    name: Callable[[tuple[int, ...]], str] = str,
    apart: Callable[[tuple[int, ...], Floats], Mapping[str, Any]] = lambda *_: {},
    level: float = LEVEL,
) -> Agreement:
    """Test known values against an adjustment.

    `differences` (n, k) are adjusted minus known values, NaN if unknown; `given` (n, k, k) are covariances of
    the known values. `cofactors` are joint (n k, n k); with the cofactors of each point, (n, k, k), all
    points together are not tested. `scale` is the variance of unit weight with `second` degrees of freedom.
    `apart` returns the fields of the difference of a point by its (k,) standard deviations, C included.
    """
    count, width = differences.shape
    rows = np.isfinite(differences)
    alone = cofactors.ndim == 3
    each = range(count)
    own = cofactors if alone else cofactors.reshape(count, width, count, width)[each, :, each, :]
    found, dimension = np.full(count, math.nan), np.full(count, math.nan)
    sd = np.sqrt(np.diagonal(scale * own + given, axis1=1, axis2=2))
    for point in np.flatnonzero(rows.any(axis=1)).tolist():
        chosen = rows[point]
        covariance = (scale * own[point] + given[point])[np.ix_(chosen, chosen)]
        found[point], dimension[point] = quadratic(differences[point, chosen], covariance)
    together = joint = None
    if not alone and rows.any():
        whole = scale * cofactors
        for point in range(count):
            place = slice(point * width, (point + 1) * width)
            whole[place, place] += given[point]
        flat = np.flatnonzero(rows)
        joint = flat, differences.ravel()[flat], whole[np.ix_(flat, flat)]
        omega, rank = quadratic(*joint[1:])
        together = global_test(omega, rank, level, second)
        joint = joint if rank == len(flat) else None
    if math.isinf(second):
        points = Tested(Phrase("test.checks"), found, name, "T", dimension)
    else:
        points = Tested(Phrase("test.checks"), found / dimension, name, "F", dimension, second)
    return Agreement(points, together, sd, apart, joint)


def quadratic(d: Floats, covariance: Floats) -> tuple[float, float]:
    """Return d' C^+ d and rank C; (NaN, NaN) if C is unknown, (NaN, 0) if exact."""
    if not np.isfinite(covariance).all():
        return math.nan, math.nan
    scale = scale_of(covariance)
    scaled, y = covariance / np.outer(scale, scale), d / scale
    # The last row of the factor of C bordered by d is L^-1 d; a second elimination is unnecessary.
    bordered = np.empty((len(d) + 1, len(d) + 1))
    bordered[:-1, :-1] = scaled
    bordered[-1, :-1] = bordered[:-1, -1] = y
    bordered[-1, -1] = BORDER * (1.0 + y @ y)
    root = root_of(bordered)
    if root is not None:
        return float(root[-1, :-1] @ root[-1, :-1]), float(len(d))
    values, vectors = np.linalg.eigh(scaled)
    free = values > SINGULAR
    along = vectors.T @ y
    return (
        (float((along[free] ** 2 / values[free]).sum()), float(free.sum())) if free.any() else (math.nan, 0.0)
    )


def scale_of(covariance: Floats) -> Floats:
    """Return (m,) standard deviations, with zeros replaced by 1."""
    sd = np.sqrt(np.diag(covariance))
    return np.where(sd > 0, sd, 1.0)


def root_of(scaled: Floats) -> Floats | None:
    """Return the Cholesky factor of a unit-diagonal, possibly bordered matrix, or None."""
    try:
        root = np.asarray(np.linalg.cholesky(scaled), dtype=np.float64)
    except np.linalg.LinAlgError:
        return None
    return root if float(np.diag(root).min(initial=1.0)) ** 2 > SINGULAR else None
