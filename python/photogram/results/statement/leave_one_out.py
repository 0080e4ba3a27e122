"""Control points as check points: each predicted by all other observations.

With R_g the cofactors of the residuals ~v of a control point, both divided by its standard deviations
(statistics: 2.3), survey - predicted = sd R_g^- ~v. Its covariance is sd R_g^- sd s2, including the survey's
own variance, and T = ~v' R_g^- ~v / s2 is chi-square with the rank. These checks are not independent: common
errors of all control remain undetected.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.observations import Control
from photogram.results.statement.comparison import in_order, turned_to_east
from photogram.results.statement.honest import LEVEL

if TYPE_CHECKING:
    from photogram import Result

PREDICTABLE = 0.01  # Least eigenvalue of R_g of a predictable direction


@dataclass(frozen=True, eq=False)
class LeftOut:
    point: str  # Its name
    # (3,) predicted minus survey, east, north, up; linear unit; NaN if free or hardly predictable
    difference: Floats
    sd: Floats  # (3,) its standard deviations
    covariance: Floats  # (3, 3); zero if missing
    # Test, number of predictable directions, upper probability
    T: float
    rank: int
    p: float
    # Redundancy numbers of the k weighted components; eigenvalues of R_g, ascending
    redundancy: Floats
    eigenvalues: Floats


def leave_one_out(result: Result) -> list[LeftOut]:
    """Return used control points predicted by the others, in order of names."""
    block, found = result.block, []
    observed = {each.point: each for each in block.observations.of_type(Control)}
    held_by = np.asarray(np.isfinite(block.point_sd).any(axis=1))
    held_by[[row for row, name in enumerate(block.point_ids) if name in observed]] = True
    control = np.flatnonzero(result.used_points & held_by)
    residuals = result.point_residuals
    for row in in_order(block, control).tolist():
        name = block.point_ids[row]
        q = result.point_cofactors[row]
        turn = turned_to_east(block, result.point_positions[row : row + 1])[0]
        if name in observed:
            given, own = np.asarray(observed[name].position, dtype=float), observed[name].precision
            root = np.asarray(np.linalg.cholesky(own), dtype=np.float64)
            # In geographic blocks they are along east, north, up already.
            factor = root if block.geographic else turn @ root
            v = turn @ (given - result.point_positions[row])
            found.append(_predicted(name, np.arange(3), v, factor, turn @ q @ turn.T, result))
            continue
        held = np.flatnonzero(np.isfinite(block.point_sd[row]) & (block.point_sd[row] > 0))
        if len(held):
            # Weighted along the axes of the block; all axes of geocentric blocks are transformed together.
            sd, v = block.point_sd[row, held], residuals[row, held]
            if len(held) == 3:
                whole = turn @ np.diag(sd)
                found.append(_predicted(name, held, turn @ v, whole, turn @ q @ turn.T, result))
            else:
                units = np.diag(turn)[held]
                inside = np.outer(units, units) * q[np.ix_(held, held)]
                found.append(_predicted(name, held, units * v, np.diag(units * sd), inside, result))
    return found


def limit_of(found: Sequence[LeftOut]) -> float:
    """Return the probability limit for disagreeing control (Bonferroni)."""
    return LEVEL / max(len(found), 1)


def _predicted(name: str, held: np.ndarray, v: Floats, factor: Floats, q: Floats, result: Result) -> LeftOut:
    """Return a point from residuals v, a root F of their covariance, cofactors q."""
    inverse = np.linalg.inv(factor)
    residual, redundancy = inverse @ v, np.eye(len(v)) - inverse @ q @ inverse.T
    values, vectors = np.linalg.eigh((redundancy + redundancy.T) / 2)
    shown = values > PREDICTABLE
    pseudo = (vectors[:, shown] / values[shown]) @ vectors[:, shown].T
    statistic = float(residual @ pseudo @ residual) / result.covariance_scale
    rank = int(shown.sum())
    # Components that are mostly along directions that the rest does not predict.
    blind = (vectors[:, ~shown] ** 2).sum(axis=1) > 0.5
    difference, sd, covariance = np.full(3, np.nan), np.full(3, np.nan), np.zeros((3, 3))
    own = factor @ pseudo @ factor.T * result.covariance_scale
    difference[held] = np.where(blind, np.nan, -(factor @ pseudo @ residual))
    sd[held] = np.where(blind, np.nan, np.sqrt(np.diag(own)))
    covariance[np.ix_(held, held)] = own
    p = _photocore.chi_square(statistic, rank, upper=True) if rank else float("nan")
    return LeftOut(name, difference, sd, covariance, statistic, rank, p, np.diag(redundancy), values)
