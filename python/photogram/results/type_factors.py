"""Agreement of given standard deviations with residuals, by type of observation."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.results.network_trial import CONTROL, IMAGE, OBSERVATION, NetworkTrial, Tests
from photogram.statistics.evidence import MEDIAN
from photogram.statistics.findings import LARGEST_FACTOR, NOMINAL, Text, TypeFactor
from photogram.statistics.limits import global_test
from photogram.statistics.reliability import TESTABLE

MOST_ROWS = 64  # Largest number of observations with an exact sum of R_ij^2
VISIBLE = 1e-6  # Least redundancy of a direction
FACTORS = 100  # Number of examined factors
FEW, WEAK = 20.0, 0.1
"""Redundancy, and mean redundancy, below which chi-square with r degrees of freedom is wrong."""


def type_factors(
    trial: NetworkTrial, tests: Tests, limit: float, standing: tuple[float, float]
) -> list[TypeFactor]:
    """Return the agreement of the standard deviations of each type.

    Images are included if the global test of their sum of squares and degrees of freedom rejects. `limit`:
    undetected factors of standard deviations that matter.
    """
    suspects, test = trial.suspects, global_test(*standing)
    images = test is not None and (test.rejected_high or test.rejected_low)
    used = tests.active & (suspects.kinds <= OBSERVATION) & (images | (suspects.kinds != IMAGE))
    found: dict[Text, list[Indices]] = {}
    for kind in np.unique(suspects.kinds[used]).tolist():
        groups = np.flatnonzero(used & (suspects.kinds == kind))
        if kind != OBSERVATION:
            found[suspects.type(kind, 0)] = [groups]
            continue
        for group in groups.tolist():
            name = suspects.type(kind, int(suspects.subjects[group]))
            found.setdefault(name, []).append(np.array([group]))
    return [_factor(trial, tests, kind, np.hstack(groups), limit) for kind, groups in found.items()]


def _factor(trial: NetworkTrial, tests: Tests, kind: Text, groups: Indices, limit: float) -> TypeFactor:
    """Return the agreement of the standard deviations of some groups."""
    suspects = trial.suspects
    own = np.zeros(len(suspects), dtype=bool)
    own[groups] = True
    rows = np.flatnonzero(np.repeat(own, np.diff(suspects.row_starts)) & np.isfinite(tests.redundancy))
    residuals, redundancy, sd = tests.residual[rows], tests.redundancy[rows], trial.deviations[rows]
    squares, r = float(np.nansum(residuals**2)), float(redundancy.sum())
    with np.errstate(divide="ignore", invalid="ignore"):
        w = np.abs(residuals) / np.sqrt(redundancy)
    w = w[np.isfinite(w) & (redundancy > TESTABLE)]
    is_control = bool(suspects.kinds[groups[0]] == CONTROL)
    equal = suspects.kinds[groups[0]] == IMAGE and len(sd) and np.ptp(sd) <= 1e-9 * sd[0]
    spread, likeliest = math.nan, None
    if len(rows) <= MOST_ROWS and r < max(FEW, WEAK * len(rows)):
        mixed = TypeFactor(kind, squares, r, spread=float(np.square(redundancy).sum()))
        # The squares of R outside the diagonal increase s.
        if squares > NOMINAL**2 * r or (is_control and mixed.undetected > limit):
            within = np.flatnonzero(np.isin(np.hstack([*map(suspects.rows, groups.tolist())]), rows))
            found = trial.core.responses(groups.tolist())[within][:, rows]
            spread, likeliest = float(np.square(found).sum()), _likeliest(found, residuals)
    return TypeFactor(
        kind,
        squares,
        r,
        median=float(np.median(w)) / MEDIAN if w.size else math.nan,
        sd=float(sd[0]) if equal else math.nan,
        unit=suspects.given.image_unit,
        spread=spread,
        likeliest=likeliest,
    )


def _likeliest(cofactors: Floats, residuals: Floats) -> tuple[float, float]:
    """Return the likeliest factor F of the standard deviations of residuals, and the gain of log L.

    Along the eigenvectors of their cofactors R, with eigenvalues mu, residuals have the variances mu + (F^2 -
    1) mu^2.
    """
    mu, vectors = np.linalg.eigh((cofactors + cofactors.T) / 2)
    seen = mu > VISIBLE
    squares = (vectors.T[seen] @ residuals) ** 2 / mu[seen]
    factors = np.geomspace(1.0, LARGEST_FACTOR, FACTORS)
    growth = 1.0 + np.multiply.outer(factors**2 - 1.0, mu[seen])
    gains = (squares * (1.0 - 1.0 / growth) - np.log(growth)).sum(axis=1) / 2
    best = int(gains.argmax())
    return float(factors[best]), float(gains[best])
