"""Combination of all cases: one set of parameters (NOAA TR NOS 57, equations 56 to 63)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.case import PlacedCase
from photogram.comparator.correction import Correction
from photogram.comparator.fits import AffineFit, Residuals, RigidFit, fit_rigid, rotation_matrix
from photogram.comparator.polynomial import COUNT, Polynomial, fit_polynomial
from photogram.lazy_dataclasses import dataclass, replace


@dataclass(frozen=True, eq=False)
class CombinedLinear:
    """Combined linear parameters of all cases."""

    correction: Correction  # Scales and lack of orthogonality
    sigma0_um: float  # Standard error of unit weight and its degrees of freedom (equation 57)
    degrees_of_freedom: int
    covariance: Floats  # (3, 3) of scale x, scale y, lack of orthogonality in radians (equation 58)
    cases: tuple[RigidFit, ...]  # Rigid fit of each case after the correction


@dataclass(frozen=True, eq=False)
class SinglePolynomial:
    """Polynomials of one case, and the residuals after its linear adjustment."""

    polynomial: Polynomial
    residuals: Residuals

    @property
    def covariance(self) -> Floats:
        """(18, 18) coefficient covariance, metre units (m^2 times powers of 1/m), x first (equation 61)."""
        return self.residuals.sigma0_um**2 * self.polynomial.cofactors


@dataclass(frozen=True, eq=False)
class CombinedPolynomial:
    """Combined polynomials of all cases."""

    correction: Correction  # Linear parameters and polynomials
    polynomial: Polynomial
    sigma_um: tuple[float, float]  # (2,) standard deviations of the residuals in x and in y (equation 62)
    degrees_of_freedom: int  # Degrees of freedom of each
    cases: tuple[RigidFit, ...]  # Rigid fit of each case after the whole correction

    @property
    def sigma0_um(self) -> float:
        """Standard error of unit weight of both axes (equation 62)."""
        return math.sqrt(sum(sigma**2 for sigma in self.sigma_um) / 2)

    @property
    def covariance(self) -> Floats:
        """(18, 18) coefficient covariance, metre units (m^2 times powers of 1/m), x first (equation 61)."""
        return self.sigma0_um**2 * self.polynomial.cofactors


def combine_linear(cases: Sequence[PlacedCase], fits: Sequence[AffineFit]) -> CombinedLinear:
    """Form the generalised weighted mean of the linear parameters of the cases.

    With the inverse cofactors P_j of case j: mean = (sum P)^-1 sum P x. Its sum of squares adds to the sums
    of the cases.
    """
    linear = [fit.parameters for fit in fits]
    values = np.array([[each.scale_x, each.scale_y, each.nonorthogonality_rad] for each in linear])
    weights = [np.linalg.inv(fit.cofactors[:3, :3]) for fit in fits]
    total = np.sum(weights, axis=0)
    # Deviations from the first case avoid cancellation for scales near one.
    offsets = values - values[0]
    mean = np.linalg.solve(total, np.sum([w @ x for w, x in zip(weights, offsets, strict=True)], axis=0))
    squares = sum(sum(fit.residuals.squares_um2[:2]) for fit in fits)
    squares += sum(float((x - mean) @ w @ (x - mean)) for w, x in zip(weights, offsets, strict=True))
    dof = 2 * sum(len(case.points) for case in cases) - 3 * (len(cases) + 1)
    sigma0 = math.sqrt(squares / dof)
    scale_x, scale_y, lean = (values[0] + mean).tolist()
    covariance = sigma0**2 * np.linalg.inv(total)
    correction = Correction(scale_x, scale_y, lean)
    correction.covariance[:3, :3] = covariance
    lost = 0.5 * (3 + 3 / len(cases))
    return CombinedLinear(correction, sigma0, dof, covariance, _refit(cases, correction, lost))


def _refit(cases: Sequence[PlacedCase], correction: Correction, lost: float) -> tuple[RigidFit, ...]:
    return tuple(
        fit_rigid(case.points, correction.apply(case.means_um), case.grid_um, lost=lost) for case in cases
    )


def single_polynomial(case: PlacedCase, fit: AffineFit, *, as_published: bool = False) -> SinglePolynomial:
    """Fit polynomials to the linear residuals of one case (equations 59 to 61).

    `as_published` omits the sign change of the grid residuals.
    """
    parameters = fit.parameters
    linear = case.means_um @ parameters.linear_matrix.T
    polynomial = fit_polynomial(linear, fit.residuals.comparator_um)
    values = polynomial.evaluate(linear)
    comparator = fit.residuals.comparator_um - values
    sign = 1.0 if as_published else -1.0
    grid = sign * comparator @ rotation_matrix(parameters.rotation_rad).T
    return SinglePolynomial(
        polynomial, Residuals(case.points, linear + values, comparator, grid, float(COUNT))
    )


def combine_polynomial(cases: Sequence[PlacedCase], linear: CombinedLinear) -> CombinedPolynomial:
    """Fit polynomials to the residuals of the combined linear parameters of all cases."""
    places = np.vstack([fit.residuals.xy_um for fit in linear.cases])
    residuals = np.vstack([fit.residuals.comparator_um for fit in linear.cases])
    polynomial = fit_polynomial(places, residuals)
    dof = len(places) - COUNT
    squares = ((residuals - polynomial.evaluate(places)) ** 2).sum(axis=0)
    sigma = (math.sqrt(squares[0] / dof), math.sqrt(squares[1] / dof))
    covariance = linear.correction.covariance.copy()
    covariance[3:, 3:] = (sigma[0] ** 2 + sigma[1] ** 2) / 2 * polynomial.scaled_cofactors
    correction = replace(linear.correction, polynomial=polynomial, covariance=covariance)
    fits = _refit(cases, correction, COUNT / len(cases))
    return CombinedPolynomial(correction, polynomial, sigma, dof, fits)
