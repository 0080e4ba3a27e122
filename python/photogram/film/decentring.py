"""What certificates say of decentring: a tangential profile, distortion along four semi-diagonals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.film.lens_table import RadialTable
from photogram.statistics.fits import Fit

__all__ = ["SEMI_DIAGONALS", "Tangential", "of_profile", "of_semi_diagonals"]

SEMI_DIAGONALS = ("ll", "ul", "ur", "lr")


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


def of_semi_diagonals(
    angle: Floats, distortion: Mapping[str, Floats], sd: float | None
) -> tuple[RadialTable, float, float]:
    """Return the mean table of four semi-diagonals, and what decentring they show.

    Opposite ones differ by decentring, which the mean is free of; what is left, half of ll + ur - ul - lr,
    has the variance of a single reading, and gives the standard deviation of the mean.

    Parameters
    ----------
    angle
        (n,) rad.
    distortion
        (n,) mm along each of `SEMI_DIAGONALS`.
    sd
        Of a mean, where it is known.

    Returns
    -------
    The table; the largest half difference of opposite semi-diagonals, and its standard deviation (mm).

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
    largest = float(np.abs([(ur - ll) / 2, (ul - lr) / 2]).max())
    # A half difference has twice the variance of a mean of four.
    return RadialTable(angle, (ll + ul + ur + lr) / 4, found), largest, found * math.sqrt(2)
