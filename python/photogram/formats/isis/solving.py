"""Trajectories whose corrections are those that jigsaw solves for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.csm.angles import Polynomials, fitted, to_angles
from photogram.formats.csm.isd import Isd, Positions
from photogram.formats.csm.photos import trajectory_of
from photogram.formats.isis.settings import Settings, Sigmas
from photogram.network.trajectories import Polynomial, Trajectory

__all__ = ["Solving", "solving"]

Angles = Literal["zxz", "zxz only"]


@dataclass(frozen=True, eq=False)
class Solving:
    """The trajectory of an image, and the polynomials that it begins with.

    Attributes
    ----------
    trajectory
        In metres and radians; coefficients are of time from the middle of a table, scaled by half of it.
    position, angles
        (3, n) coefficients of the polynomials that stand for the tables, to which those of corrections of
        positions are added; 0 where the tables stay.
    """

    trajectory: Trajectory
    position: Floats
    angles: Floats


def solving(isd: Isd, name: str, settings: Settings, *, held: bool) -> Solving:
    """Return what is adjusted of an image.

    Parameters
    ----------
    isd
        Its support data.
    name
        Of the trajectory.
    settings
        Which coefficients are unknown.
    held
        Whether none is.

    Raises
    ------
    InputError
        Records that ask for velocities and have none.
    """
    counts = (0, 0) if held else (settings.position_coefficients, settings.angle_coefficients)
    position, isd, places = _positions(isd, settings, counts[0])
    rotation, angles, kind = _angles(isd, settings, counts[1])
    own = trajectory_of(isd, name, interpolation="isis", position=position)
    if rotation is not None:
        own = replace(own, rotation=rotation, angles=kind)
    return Solving(own, places, angles)


def _scaled(times: Floats) -> tuple[float, float]:
    """Return the middle of records and half of what they span; 1 s where there is one."""
    return float(times[0] + times[-1]) / 2, float(times[-1] - times[0]) / 2 or 1.0


def _positions(isd: Isd, settings: Settings, count: int) -> tuple[Polynomial | None, Isd, Floats]:
    """Return corrections of positions, support data with what they are added to, and its coefficients."""
    own, none = isd.position, np.zeros((3, 0))
    if not count:
        return None, isd, none
    degree = max(settings.spk_solve_degree, count - 1)
    reference, scale = _scaled(own.times)
    sd = deviations(settings.position_sigmas, count, degree)
    basis = Polynomial(degree, reference, scale, sd=sd)
    if settings.over_hermite:
        return basis, isd, np.zeros((3, degree + 1))
    fit = fitted(own.times, own.places, min(settings.spk_degree, len(own.times) - 1))
    fit = _of_degree(fit, degree)
    if len(own.times) > 1:
        times, places = fit.sampled(float(own.times[0]), float(own.times[-1]))
        isd = replace(isd, position=Positions(times, places, None, "lagrange"))
    return basis, isd, fit.coefficients


def _angles(isd: Isd, settings: Settings, count: int) -> tuple[Polynomial | None, Floats, Angles]:
    """Return the polynomials of angles with what is known of them, their first values, and what they are."""
    own, none = isd.pointing, np.zeros((3, 0))
    if not count:
        return None, none, "zxz"
    degree = max(settings.ck_solve_degree, count - 1)
    reference, scale = _scaled(own.times)
    sd = deviations(tuple(None if s is None else np.deg2rad(s) for s in settings.angle_sigmas), count, degree)
    if not settings.twist:
        sd[:, 2] = 0.0
    if settings.over_existing:
        return Polynomial(degree, reference, scale, sd=sd), np.zeros((3, degree + 1)), "zxz"
    angles = to_angles(own.matrices)
    fit = _of_degree(fitted(own.times, angles, min(settings.ck_degree, len(own.times) - 1)), degree)
    basis = Polynomial(degree, reference, scale, value=fit.coefficients.T, sd=sd)
    return basis, fit.coefficients, "zxz only"


def _of_degree(fit: Polynomials, degree: int) -> Polynomials:
    """Return polynomials of another degree: with zeros, or without their last coefficients, as jigsaw has it."""
    own = np.zeros((3, degree + 1))
    most = min(degree + 1, fit.coefficients.shape[1])
    own[:, :most] = fit.coefficients[:, :most]
    return fit._replace(coefficients=own)


def deviations(sigmas: Sigmas, count: int, degree: int) -> Floats:
    """Return (degree + 1, 3) standard deviations of coefficients, of which the first `count` are unknown."""
    found = np.zeros((degree + 1, 3))
    given = [np.inf if sigma is None else sigma for sigma in sigmas]
    for k in range(count):
        found[k] = given[k] if k < len(given) else np.inf
    return found
