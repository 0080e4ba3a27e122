"""Lens parameters and covariance from the distortion tables of certificates.

The laboratory measures image points of rays at known angles alpha. The table lists dr, measured minus ideal
radius, with r = c0 tan alpha and the calibrated focal length c0. The curve is

    dr(r) = k0 r + k1 r^3 + k2 r^5 + k3 r^7.

k0 belongs to c: the laboratory chose c0 to balance the curve. With |c| = c0 (1 + k0) and A_j = k_j / (1 +
k0)^(2j + 1), the forward camera `brown_forward` is the same mapping.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.distributions import critical_chi_square
from photogram.statistics.fits import Fit
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import Phrase, phrase

MAX_TERMS = 3  # odd terms of cameras
LEVEL = 0.01  # significance level of a term
STEP = 0.01  # of numerical differences, in standard deviations


@dataclass(frozen=True, eq=False)
class RadialTable:
    """Radial distortion table of a certificate.

    Attributes
    ----------
    angle
        (n,) angles from the axis, rad.
    distortion
        (n,) mm, positive outwards, measured minus ideal.
    sd
        Standard deviation of a value, mm.
    correlation
        Correlation of any two values.
    """

    angle: Floats
    distortion: Floats
    sd: float = 1.5e-3
    correlation: float = 0.0

    @property
    def covariance(self) -> Floats:
        """(n, n) mm^2: sd^2 ((1 - rho) I + rho 11')."""
        n = len(self.angle)
        return self.sd**2 * ((1 - self.correlation) * np.eye(n) + self.correlation)


@dataclass(frozen=True, eq=False)
class Curve:
    """Fitted distortion curve with t odd terms.

    Attributes
    ----------
    focal_length, sd_focal_length
        c0 to which the angles refer, mm.
    radius
        (n,) c0 tan alpha of the table, mm.
    coefficients, covariance
        (1 + t,) k0, k1 ..., of mm in powers of mm.
    residuals, redundancy, standardized
        (n,) mm; w.
    omega, test
        Weighted sum of squares, and its test; None without degrees of freedom.
    """

    focal_length: float
    sd_focal_length: float
    radius: Floats
    coefficients: Floats
    covariance: Floats
    residuals: Floats
    redundancy: Floats
    standardized: Floats
    omega: float
    test: GlobalTest | None

    @property
    def terms(self) -> int:
        """Number of odd terms in addition to k0."""
        return len(self.coefficients) - 1

    def at(self, radius: Floats) -> Floats:
        """Return the distortion (m,) at radii (m,), mm."""
        return np.asarray(_columns(np.asarray(radius, float), self.terms) @ self.coefficients)

    def sd_at(self, radius: Floats) -> Floats:
        """Return the standard deviation of the distortion at radii: sqrt(j Q j')."""
        j = _columns(np.asarray(radius, float), self.terms)
        return np.asarray(np.sqrt(np.einsum("ni,ij,nj->n", j, self.covariance, j)))


@dataclass(frozen=True, eq=False)
class LensParameters:
    """Lens parameters of a camera with their covariance.

    Attributes
    ----------
    model
        `brown_forward` or `brown`.
    names, values, covariance
        c (negative) and the radial terms, mm in powers of mm.
    apart
        Largest difference of camera and curve within the table, mm; 0 for the same mapping.
    """

    model: str
    names: tuple[str, ...]
    values: Floats
    covariance: Floats
    apart: float = 0.0


def fit_curve(table: RadialTable, focal_length: float, sd_focal_length: float, terms: int) -> Curve:
    """Fit a distortion table by k0 and some odd terms.

    InputError: if there are fewer values than unknowns, or if equal angles make the fit singular.
    """
    radius = focal_length * np.tan(table.angle)
    if len(np.unique(radius)) < terms + 1:
        raise InputError(phrase("films.few-angles", angles=len(radius), terms=terms))
    fit = Fit.of(table.distortion, table.covariance, _columns(radius, terms))
    freedom = len(radius) - terms - 1
    return Curve(
        focal_length=focal_length,
        sd_focal_length=sd_focal_length,
        radius=radius,
        coefficients=fit.parameters,
        covariance=fit.cofactors,
        residuals=fit.residuals,
        redundancy=fit.redundancy,
        standardized=fit.standardized,
        omega=fit.omega,
        test=global_test(fit.omega, freedom) if freedom else None,
    )


def curves_of(table: RadialTable, focal_length: float, sd_focal_length: float) -> tuple[Curve, ...]:
    """Return the curves with one to three odd terms, at most n - 3 for n angles.

    InputError: if there are fewer than four angles.
    """
    most = min(MAX_TERMS, len(np.unique(table.angle)) - 3)
    if most < 1:
        raise InputError(phrase("films.short-table", angles=len(table.angle)))
    return tuple(fit_curve(table, focal_length, sd_focal_length, terms) for terms in range(1, most + 1))


def chosen(curves: Sequence[Curve]) -> Curve:
    """Return the first curve that another term improves by <= chi-square(0.99; 1)."""
    limit = critical_chi_square(LEVEL, 1)
    for curve, more in pairwise(curves):
        if curve.omega - more.omega <= limit:
            return curve
    return curves[-1]


def forward(curve: Curve) -> LensParameters:
    """Return c and A1 ... of `brown_forward`: the same mapping, r0 = 0."""
    c0, (k0, *odd) = curve.focal_length, curve.coefficients.tolist()
    grown = 1 + k0
    powers = np.array([2 * j + 1 for j in range(1, curve.terms + 1)])
    terms = np.array(odd) / grown**powers
    # Rows: c, A1 ...; columns: c0, k0, k1 ...
    by = np.zeros((1 + curve.terms, 2 + curve.terms))
    by[0, :2] = -grown, -c0
    by[1:, 1] = -powers * terms / grown
    by[1:, 2:] = np.diag(grown ** -powers.astype(float))
    return LensParameters(
        "brown_forward",
        ("c", *(f"A{j}" for j in range(1, curve.terms + 1))),
        np.array([-c0 * grown, *terms]),
        by @ _with_focal_length(curve) @ by.T,
    )


def backward(curve: Curve) -> LensParameters:
    """Return c and K1 ... of `brown`, fitted to -dr at the distorted radii."""

    def fitted(given: Floats) -> Floats:
        c0, coefficients = given[0], given[1:]
        ideal = curve.radius / curve.focal_length * c0
        distorted = ideal + _columns(ideal, curve.terms) @ coefficients
        columns = _columns(distorted, curve.terms)
        size = np.linalg.norm(columns, axis=0)
        k = np.linalg.lstsq(columns / size, ideal - distorted, rcond=None)[0] / size
        return np.array([-c0 / (1 + k[0]), *(k[1:] / (1 + k[0]))])

    given = np.array([curve.focal_length, *curve.coefficients])
    covariance = _with_focal_length(curve)
    values = fitted(given)
    sd = np.sqrt(np.diag(covariance))
    steps = np.diag(STEP * np.where(sd > 0, sd, np.abs(given)))
    changes = [(fitted(given + step) - fitted(given - step)) / (2 * step.sum()) for step in steps]
    by = np.column_stack(changes)
    distorted = curve.radius + curve.at(curve.radius)
    corrected = _columns(distorted, curve.terms)[:, 1:] @ values[1:] + distorted
    apart = corrected - -values[0] / curve.focal_length * curve.radius
    names = ("c", *(f"K{j}" for j in range(1, curve.terms + 1)))
    return LensParameters("brown", names, values, by @ covariance @ by.T, float(np.abs(apart).max()))


def _with_focal_length(curve: Curve) -> Floats:
    whole = np.zeros((2 + curve.terms,) * 2)
    whole[0, 0] = curve.sd_focal_length**2
    whole[1:, 1:] = curve.covariance
    return whole


def _columns(radius: Floats, terms: int) -> Floats:
    return np.asarray(radius)[:, np.newaxis] ** (2 * np.arange(terms + 1) + 1)


SEMI_DIAGONALS = ("ll", "ul", "ur", "lr")
ELSEWHERE = 4.0  # Significant distance of the point of symmetry (standard deviations)


@dataclass(frozen=True)
class Tangential:
    """Decentring distortion: the profile P(r) = J1 r^2, largest along the axis phi0.

    Attributes
    ----------
    j1, sd_j1
        J1 and the standard deviation of both components, 1/mm.
    phi0
        rad from +x, counter-clockwise.
    sign
        1 or -1: sign convention of the laboratory.
    """

    j1: float
    phi0: float
    sign: int
    sd_j1: float

    @property
    def terms(self) -> tuple[float, float]:
        """B1 and B2 of `brown_forward`: -J1 sin(phi0), J1 cos(phi0)."""
        size = self.sign * self.j1
        return -size * math.sin(self.phi0), size * math.cos(self.phi0)


def of_semi_diagonals(
    angle: Floats, distortion: Mapping[str, Floats], sd: float | None
) -> tuple[Floats, float, list[Phrase]]:
    """Return the mean of four semi-diagonals (n,), its sd, and remarks on the differences of opposite ones.

    Opposite ones differ by h = u o + d r^2 in the direction u. d is the decentring, o the point of symmetry
    relative to the origin of the radii. Half of ll + ur - ul - lr has the variance of a single reading. It
    gives the standard deviation of the mean without a given `sd` (mm); the variance of a half difference is
    twice the mean's. Angles are (n,) rad, distortion (n,) mm along each of `SEMI_DIAGONALS`. InputError: if
    readings are equal and `sd` is not given.
    """
    ll, ul, ur, lr = (np.asarray(distortion[name], float) for name in SEMI_DIAGONALS)
    single = math.sqrt(float(np.mean(((ll + ur - ul - lr) / 2) ** 2)))
    found = single / 2 if sd is None else sd
    if not found > 0:
        raise InputError(phrase("films.equal-diagonals"))
    halves, remarks = np.column_stack([ur - ll, ul - lr]) / 2, list[Phrase]()
    columns = np.column_stack([np.ones(len(angle)), np.tan(angle) ** 2])
    if len(np.unique(angle)) > columns.shape[1]:
        constant = np.linalg.lstsq(columns, halves, rcond=None)[0][0]
        sd_constant = found * math.sqrt(2 * np.linalg.inv(columns.T @ columns)[0, 0])
        # Along the diagonals to ur and to ul.
        x, y = (np.array([[1.0, -1.0], [1.0, 1.0]]) @ constant / math.sqrt(2)).tolist()
        if max(abs(x), abs(y)) > ELSEWHERE * sd_constant:
            remarks.append(phrase("films.symmetry-elsewhere", x=x, y=y, sd=sd_constant))
            halves = halves - constant
    sizes = {"size": float(np.abs(halves).max() * 1e3), "sd": found * math.sqrt(2) * 1e3}
    remarks.append(phrase("films.decentring-of-diagonals", **sizes))
    return (ll + ul + ur + lr) / 4, found, remarks
