"""Normal equations of the parameters with the stars reduced out (NOAA TR NOS 55, equations 64 to 71).

The engine does this block by block for itself; here it serves the report's own iteration, the combination of
attitudes, and the naming of what the stars do not determine, which all need the whole matrix.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.errors import AdjustmentError
from photogram.messages import listed
from photogram.stellar.parameters import NAMES
from photogram.stellar.problem import Problem

__all__ = ["Reduced", "columns", "invert", "log_determinant", "reduce", "singular", "undetermined"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Reduced:
    """Reduced normal equations of 26 parameters and S stars.

    Attributes
    ----------
    normal, right
        (26, 26) and (26,): N and l, without the weights of the parameters.
    star_inverse, coupling, star_right
        (S, 2, 2), (S, 2, 26), (S, 2): the report's (1)^-1, (2) and (8) of every star.
    rows
        (m, 2, 26) partials of the plate coordinates by the parameters.
    star_rows
        (m, 2, 2) partials by the star.
    constant
        (m, 2) discrepancies.
    """

    normal: Floats
    right: Floats
    star_inverse: Floats
    coupling: Floats
    star_right: Floats
    rows: Floats
    star_rows: Floats
    constant: Floats

    def star_corrections(self) -> Floats:
        """Return (S, 2) corrections of the stars where the parameters need none."""
        return np.asarray(np.einsum("sij,sj->si", self.star_inverse, self.star_right), float)


def columns(problem: Problem, equations: dict[str, Any], groups: NDArray[np.int64]) -> Floats:
    """Return (m, 2, 26) partials by all parameters."""
    rows = np.zeros((len(groups), 2, len(NAMES)))
    rows[:, :, 9:] = equations["common"]
    image = np.arange(len(groups))
    for k in range(3):
        rows[image, :, 3 * groups + k] = equations["pointing"][:, :, k]
    return rows


def reduce(problem: Problem, core: Any, equations: dict[str, Any], places: Floats) -> Reduced:
    """Form the normal equations of a problem and reduce the stars out.

    Parameters
    ----------
    problem
        The problem.
    core
        The problem at the same values in the core, for the axis.
    equations
        Discrepancies and partials of the images.
    places
        (S, 2) values of the stars at which they were formed.

    Raises
    ------
    AdjustmentError
        A star's own normal equations are singular (error 2), or the values put it out of sight.
    """
    unseen = ~np.isfinite(equations["constant"]).all(axis=1)
    if unseen.any():
        stars = listed([problem.star_ids[i] for i in np.unique(problem.image_stars[unseen])])
        raise AdjustmentError(f"below the horizon or behind the camera: star {stars}")
    rows = columns(problem, equations, problem.image_groups)
    star_rows, constant = equations["star"], equations["constant"]
    count = len(problem.star_ids)
    weighted_star = np.swapaxes(star_rows, 1, 2) @ problem.image_weights
    known = (problem.known & ~problem.held)[:, None, None]
    prior = np.where(known, problem.star_weights, 0.0)
    own = prior.copy()
    coupling, right = np.zeros((count, 2, len(NAMES))), np.zeros((count, 2))
    np.add.at(own, problem.image_stars, weighted_star @ star_rows)
    np.add.at(coupling, problem.image_stars, weighted_star @ rows)
    np.add.at(right, problem.image_stars, np.einsum("mij,mj->mi", weighted_star, constant))
    right += np.einsum("sij,sj->si", prior, problem.star_places - places)
    determinant = np.linalg.det(own)
    if (np.abs(determinant) < 1e-300).any():
        star = problem.star_ids[int(np.argmin(np.abs(determinant)))]
        raise AdjustmentError(f"ERROR 2: no inverse for the submatrix of star {star}")
    inverse = np.where(problem.held[:, None, None], 0.0, np.linalg.inv(own))
    weighted = np.einsum("mij,mjk->mik", problem.image_weights, rows)
    normal = np.einsum("mik,mil->kl", rows, weighted)
    total = np.einsum("mik,mi->k", weighted, constant)
    normal -= np.einsum("sik,sij,sjl->kl", coupling, inverse, coupling)
    total -= np.einsum("sik,sij,sj->k", coupling, inverse, right)
    if problem.axis is not None:
        axis = core.axis_equations()
        row = columns(problem, axis, np.array([problem.axis.group]))[0]
        normal += row.T @ problem.axis.weight @ row
        total += row.T @ problem.axis.weight @ axis["constant"][0]
    return Reduced(normal, total, inverse, coupling, right, rows, star_rows, constant)


def invert(normal: Floats, free: Bools) -> Floats:
    """Return the inverse over the free parameters, zero elsewhere; columns are scaled to unit diagonal first.

    Raises
    ------
    AdjustmentError
        Parameters that the stars do not determine, named.
    """
    inverse = np.zeros_like(normal)
    chosen = np.flatnonzero(free)
    part = normal[np.ix_(chosen, chosen)]
    lost = undetermined(normal, free)
    if lost:
        raise singular(lost)
    scale = 1.0 / np.sqrt(np.diag(part))
    inner = np.linalg.inv(part * np.outer(scale, scale))
    inverse[np.ix_(chosen, chosen)] = 0.5 * (inner + inner.T) * np.outer(scale, scale)
    return inverse


def log_determinant(normal: Floats, free: Bools) -> float:
    """Return the natural logarithm of the determinant over the free parameters; NaN where it is not positive.

    The determinant itself, which the report prints, can be beyond the range of numbers.
    """
    part = normal[np.ix_(free, free)]
    diagonal = np.diag(part)
    if not (diagonal > 0).all():
        return math.nan
    scale = 1.0 / np.sqrt(diagonal)
    sign, value = np.linalg.slogdet(part * np.outer(scale, scale))
    return float(value - 2.0 * np.log(scale).sum()) if sign > 0 else math.nan


def singular(names: list[str]) -> AdjustmentError:
    """Return error 4 of the report, with the names of the parameters."""
    return AdjustmentError(
        f"ERROR 4: no inverse for the reduced normal equations: the stars do not determine {', '.join(names)}"
    )


def undetermined(normal: Floats, free: Bools, limit: float = 1e-14) -> list[str]:
    """Name the parameters that take part in combinations which the equations do not determine."""
    chosen = np.flatnonzero(free)
    diagonal = np.diag(normal)[chosen]
    lost = {int(i) for i in chosen[diagonal <= 0]}
    chosen = chosen[diagonal > 0]
    scale = 1.0 / np.sqrt(np.diag(normal)[chosen])
    values, vectors = np.linalg.eigh(normal[np.ix_(chosen, chosen)] * np.outer(scale, scale))
    for vector in vectors.T[values < limit]:
        lost |= {int(i) for i in chosen[np.abs(vector) > 0.1 * np.abs(vector).max()]}
    return [NAMES[i] for i in sorted(lost)]
