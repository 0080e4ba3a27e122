"""What certificates say of decentring: a tangential profile, distortion along four semi-diagonals."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.statistics.fits import Fit

__all__ = ["SEMI_DIAGONALS", "SemiDiagonals", "Tangential", "of_profile", "of_semi_diagonals"]

SEMI_DIAGONALS = ("ll", "ul", "ur", "lr")
ELSEWHERE = 4.0
"""Standard deviations by which the point of symmetry is away from that about which radii count."""


@dataclass(frozen=True)
class Tangential:
    """Decentring as a certificate has it: the profile P(r) = J1 r^2, largest along the axis phi0.

    Attributes
    ----------
    j1, sd_j1
        1/mm; the standard deviation is that of both components.
    phi0
        rad from +x, counter-clockwise.
    sign
        1 or -1: how the laboratory counts the profile.
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


def of_profile(radius: Floats, displacement: Floats, sd: float) -> tuple[float, float]:
    """Return J1 and its standard deviation by a fit of P(r) = J1 r^2.

    Parameters
    ----------
    radius, displacement
        (n,) mm.
    sd
        Of a displacement, mm.
    """
    fit = Fit.of(displacement, sd**2 * np.eye(len(radius)), radius[:, np.newaxis] ** 2)
    return float(fit.parameters[0]), math.sqrt(float(fit.cofactors[0, 0]))


@dataclass(frozen=True, eq=False)
class SemiDiagonals:
    """Distortion along four semi-diagonals.

    Opposite ones differ by what lies to one side, h = u o + d r^2 with the direction u: decentring, and the
    place o of the point of symmetry, as seen from the point about which radii count.

    Attributes
    ----------
    mean, sd
        (n,) of the four, free of that; its standard deviation (mm).
    centre, sd_centre
        (2,) o, the data strip at the left; its standard deviation (mm).
    decentring
        The largest half difference of opposite ones, but for o (mm).
    """

    mean: Floats
    sd: float
    centre: Floats
    sd_centre: float
    decentring: float

    @property
    def sd_half_difference(self) -> float:
        """Of a half difference, mm: it has twice the variance of a mean of four."""
        return self.sd * math.sqrt(2)

    @property
    def is_elsewhere(self) -> bool:
        """Whether radii count about another point than that of symmetry, beyond chance."""
        return float(np.abs(self.centre).max()) > ELSEWHERE * self.sd_centre


def of_semi_diagonals(angle: Floats, distortion: Mapping[str, Floats], sd: float | None) -> SemiDiagonals:
    """Return the mean of four semi-diagonals, and what opposite ones differ by.

    What is left, half of ll + ur - ul - lr, has the variance of a single reading, and gives the standard
    deviation of the mean.

    Parameters
    ----------
    angle
        (n,) rad.
    distortion
        (n,) mm along each of `SEMI_DIAGONALS`.
    sd
        Of a mean, where it is known.

    Raises
    ------
    InputError
        Readings along the four that leave nothing from which a standard deviation could be found.
    """
    ll, ul, ur, lr = (np.asarray(distortion[name], float) for name in SEMI_DIAGONALS)
    single = math.sqrt(float(np.mean(((ll + ur - ul - lr) / 2) ** 2)))
    found = single / 2 if sd is None else sd
    if not found > 0:
        raise InputError("the four semi-diagonals are alike: give sd_um, which cannot be found from them")
    halves: Floats = np.column_stack([ur - ll, ul - lr]) / 2
    columns = np.column_stack([np.ones(len(angle)), np.tan(angle) ** 2])
    constant, sd_constant = np.zeros(2), math.inf
    if len(np.unique(angle)) > columns.shape[1]:
        constant = np.linalg.lstsq(columns, halves, rcond=None)[0][0]
        sd_constant = found * math.sqrt(2 * np.linalg.inv(columns.T @ columns)[0, 0])
    # Along the diagonals to ur and to ul.
    centre = np.array([[1.0, -1.0], [1.0, 1.0]]) @ constant / math.sqrt(2)
    four = SemiDiagonals((ll + ul + ur + lr) / 4, found, centre, sd_constant, 0.0)
    left = halves - constant if four.is_elsewhere else halves
    return replace(four, decentring=float(np.abs(left).max()))
