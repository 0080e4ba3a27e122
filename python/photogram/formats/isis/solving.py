"""Trajectories whose corrections are those that jigsaw solves for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.csm.angles import Polynomials, fitted, fitted_angles, of_angles
from photogram.formats.csm.isd import Isd, Positions, Turns
from photogram.formats.csm.photos import trajectory_of
from photogram.formats.isis.settings import Settings
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.trajectories import Polynomial, Trajectory


@dataclass(frozen=True, eq=False)
class Solving:
    """The trajectory of an image, in metres and radians, and the polynomials that it begins with.

    `position` and `angles` are (3, n) coefficients of the polynomials that stand for the tables, of time from
    the middle of a table, scaled by half of it, to which corrections are added; 0 where the tables stay.
    `over` says whether the tables of positions, and of angles, do.
    """

    trajectory: Trajectory
    position: Floats
    angles: Floats
    over: tuple[bool, bool]


def solving(isd: Isd, name: str, settings: Settings, *, held: bool, first: Isd) -> Solving:
    """Return what is adjusted of an image, or of all images of an observation: nothing if it is held.

    `isd` has the tables of all images of an observation, `first` those of its first, which say from when time
    counts, and which polynomials all begin with, as in jigsaw.
    """
    counts = (0, 0) if held else (settings.position_coefficients, settings.angle_coefficients)
    position, isd, places = _positions(isd, first.position, settings, counts[0])
    rotation, isd, angles = _angles(isd, first.pointing, settings, counts[1])
    own = trajectory_of(isd, name, interpolation="isis", position=position)
    over = settings.over_hermite, settings.over_existing
    return Solving(replace(own, rotation=rotation, angles="zxz"), places, angles, over)


def _scaled(times: Floats) -> tuple[float, float]:
    """Return the middle of records and half of what they span; 1 s where there is one."""
    return float(times[0] + times[-1]) / 2, float(times[-1] - times[0]) / 2 or 1.0


def _positions(
    isd: Isd, own: Positions, settings: Settings, count: int
) -> tuple[Polynomial | None, Isd, Floats]:
    """Return corrections of positions, support data with what they are added to, and its coefficients.

    They begin with records of their own, which those of the support data may go beyond.
    """
    if not count:
        return None, isd, np.zeros((3, 0))
    reference, scale = _scaled(own.times)
    sd = deviations(settings.position_sigmas, count, count - 1)
    basis = Polynomial(count - 1, reference, scale, sd=sd)
    if settings.over_hermite:
        return basis, isd, np.zeros((3, count))
    fit = fitted(own.times, own.places, min(settings.spk_degree, len(own.times) - 1))
    fit = _of_degree(fit, max(settings.spk_solve_degree, count - 1))
    if len(own.times) > 1:
        times, places = fit.sampled(float(isd.position.times[0]), float(isd.position.times[-1]))
        isd = replace(isd, position=Positions(times, places, None, "lagrange"))
    return basis, isd, fit.coefficients


def _angles(isd: Isd, own: Turns, settings: Settings, count: int) -> tuple[Polynomial | None, Isd, Floats]:
    """Return corrections of angles, support data with what they are added to, and its coefficients.

    Angles that are polynomials are added to a table of one record, their value in the middle: they have no
    other attitude.
    """
    if not count:
        return None, isd, np.zeros((3, 0))
    degree = count - 1 if settings.over_existing else max(settings.ck_solve_degree, count - 1)
    reference, scale = _scaled(own.times)
    sigmas = [None if each is None else float(np.deg2rad(each)) for each in settings.angle_sigmas]
    sd = deviations(sigmas, count, degree)
    if not settings.twist:
        sd[:, 2] = 0.0
    if settings.over_existing:
        return Polynomial(degree, reference, scale, sd=sd), isd, np.zeros((3, degree + 1))
    fit = fitted_angles(own.times, own.matrices, min(settings.ck_degree, len(own.times) - 1))
    fit = _of_degree(fit, degree)
    value = fit.coefficients.T.copy()
    value[0] = 0.0
    middle = Turns(np.array([reference]), of_angles(fit.coefficients[:, :1].T), "linear")
    basis = Polynomial(degree, reference, scale, value=value, sd=sd)
    return basis, replace(isd, pointing=middle), fit.coefficients


def _of_degree(fit: Polynomials, degree: int) -> Polynomials:
    """Return polynomials of another degree: with zeros, or without their last ones, as jigsaw has it."""
    own = np.zeros((3, degree + 1))
    most = min(degree + 1, fit.coefficients.shape[1])
    own[:, :most] = fit.coefficients[:, :most]
    return fit._replace(coefficients=own)


def deviations(sigmas: Sequence[float | None], count: int, degree: int) -> Floats:
    """Return (degree + 1, 3) standard deviations of coefficients, of which the first `count` are unknown."""
    given = [np.inf if sigma is None else sigma for sigma in sigmas]
    of_degrees = [*given, *[np.inf] * count][:count] + [0.0] * (degree + 1 - count)
    return np.repeat(of_degrees, 3).reshape(-1, 3)
