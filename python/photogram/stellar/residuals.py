"""Residuals and their tests at final parameters (the report's v-cycle; section 5.6 of its specification)."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.stellar.problem import Problem
from photogram.stellar.reduction import Reduced, log_determinant
from photogram.stellar.state import Solved

__all__ = ["complete"]


def complete(
    problem: Problem,
    core: Any,
    reduced: Reduced,
    *,
    parameters: Floats,
    free: Bools,
    places: Floats,
    residuals: Floats,
    cofactors: Floats,
    remarks: tuple[str, ...] = (),
) -> Solved:
    """Put a solution together: sums of squares, redundancy numbers and standardized residuals.

    Parameters
    ----------
    problem
        The problem.
    core
        The problem at the final parameters in the core, for the axis.
    reduced
        Reduced normal equations at these parameters.
    parameters, free
        (26,) final values, and which of them were estimated.
    places
        (S, 2) final places of the stars.
    residuals
        (m, 2) computed minus measured plate coordinates, metres.
    cofactors
        (26, 26) of the parameters.
    remarks
        What went on.
    """
    star_cofactors = reduced.star_inverse + _propagated(reduced, cofactors)
    redundancy, standardized = _image_tests(problem, reduced, cofactors, residuals)
    known = problem.known & ~problem.held
    weights = np.where(known[:, None, None], problem.star_weights, 0.0)
    star_residuals = np.where(known[:, None], places - problem.star_places, 0.0)
    star_redundancy, star_standardized = _star_tests(weights, star_cofactors, star_residuals, known)
    off = parameters - problem.initial
    axis = core.axis_equations()["constant"] if problem.axis is not None else np.zeros((0, 2))
    axis_sum = float(sum(v @ problem.axis.weight @ v for v in axis)) if problem.axis else 0.0
    return Solved(
        parameters=parameters,
        places=places,
        free=free,
        cofactors=cofactors,
        star_cofactors=star_cofactors,
        star_inverse=reduced.star_inverse,
        residuals=residuals,
        redundancy=redundancy,
        standardized=standardized,
        star_redundancy=star_redundancy,
        star_standardized=star_standardized,
        axis_residual=-axis[0] if len(axis) else None,
        sums=(
            float(np.einsum("mi,mij,mj->", residuals, problem.image_weights, residuals)),
            float(np.einsum("si,sij,sj->", star_residuals, weights, star_residuals)),
            float(off @ problem.parameter_weights @ off) + axis_sum,
        ),
        log_determinant=log_determinant(reduced.normal + problem.parameter_weights, free),
        stop="",
        converged=True,
        levels=(),
        remarks=remarks,
    )


def _propagated(reduced: Reduced, cofactors: Floats) -> Floats:
    """Return (1)^-1 (2) N^-1 (2)^T (1)^-1 of every star: the part of the parameters."""
    tied = reduced.star_inverse @ reduced.coupling
    return np.asarray(np.einsum("sik,kl,sjl->sij", tied, cofactors, tied), float)


def _image_tests(
    problem: Problem, reduced: Reduced, cofactors: Floats, residuals: Floats
) -> tuple[Floats, Floats]:
    """Return redundancy numbers, and residuals over root of their cofactors, of the plate coordinates."""
    inverse = reduced.star_inverse[problem.image_stars]
    tied = (reduced.star_inverse @ reduced.coupling)[problem.image_stars]
    rows = reduced.rows - reduced.star_rows @ tied
    computed = np.einsum("mik,kl,mjl->mij", rows, cofactors, rows)
    computed += reduced.star_rows @ inverse @ np.swapaxes(reduced.star_rows, 1, 2)
    return _tests(problem.image_weights, computed, residuals)


def _star_tests(weights: Floats, cofactors: Floats, residuals: Floats, known: Bools) -> tuple[Floats, Floats]:
    redundancy, standardized = np.full(residuals.shape, np.nan), np.full(residuals.shape, np.nan)
    redundancy[known], standardized[known] = _tests(weights[known], cofactors[known], residuals[known])
    return redundancy, standardized


def _tests(weights: Floats, computed: Floats, residuals: Floats) -> tuple[Floats, Floats]:
    redundancy = 1.0 - np.einsum("mij,mji->mi", computed, weights)
    left = np.einsum("mii->mi", np.linalg.inv(weights) - computed)
    with np.errstate(invalid="ignore", divide="ignore"):
        standardized = np.where(redundancy > 1e-10, residuals / np.sqrt(np.maximum(left, 0)), np.nan)
    return redundancy, standardized
