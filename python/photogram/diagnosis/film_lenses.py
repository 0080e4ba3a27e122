"""Certificate lens parameters that contradict observations: sign, principal point.

Prior values mu of camera parameters, with covariance C, are observations. Their residuals v = mu - x have the
cofactors Q = C - Q_x. If mu + D a were given, and all correlated values were moved along, the weighted sum of
squares would be, to first order,

    Omega + 2 a' g + a' M a,    g = D' C^-1 v,    M = D' C^-1 Q C^-1 D

so that it decreases by T = g' M^-1 g at a = -M^-1 g (covariance M^-1). No further adjustment is needed.
"""

from __future__ import annotations

import re
from typing import Self

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.results.parts import AdjustedCamera
from photogram.results.result import Result
from photogram.words import Phrase, phrase

RADIAL = re.compile(r"[AK]\d")
POINT = ("xp", "yp")
CHANCE = 1e-4  # Probability of any hint in correct data
EXPLAINED = 0.8  # Part of the decrease of the sum of squares if all camera parameters were free
NEAR, WITHIN = 0.3, 3.0
"""Limits of the difference between the observed and the opposite value: relative, and in standard
deviations."""
TAKEN_UP = 1e-6  # Observations give no information on parameters with a smaller redundancy


@dataclass(frozen=True)
class _Fall:
    """Decrease of the sum of squares for other given values of a camera."""

    value: float  # T, relative to the remaining unit variance, and its degrees of freedom
    freedom: int
    moved: Floats  # (k,) a, and its standard deviations
    sd: Floats

    @classmethod
    def of(cls, result: Result, camera: AdjustedCamera, rows: list[int], columns: Floats) -> Self:
        """Compute the decrease for weighted parameters `rows`, moved along `columns`."""
        own, given = np.ix_(rows, rows), camera.given
        whole = np.diag(given.deviations**2)
        if (correlated := given.prior_covariance) is not None:
            whole[np.ix_(camera.weighted, camera.weighted)] = correlated
        prior = whole[own]
        weighted = np.linalg.solve(prior, columns)
        # In standard deviations of a, for perfect observations.
        size = np.sqrt(np.einsum("nk,nm,mk->k", weighted, prior, weighted))
        weighted = weighted / size
        vector = weighted.T @ (given.values - camera.values)[rows]
        values, axes = np.linalg.eigh(weighted.T @ (prior - camera.cofactors[own]) @ weighted)
        axes = axes[:, values > TAKEN_UP] / np.sqrt(values[values > TAKEN_UP])
        fall = float(((vector @ axes) ** 2).sum())
        omega, freedom = result.sum_and_freedom
        unit = max(1.0, (omega - fall) / max(freedom, 1.0))
        sd = np.sqrt(unit * (axes**2).sum(axis=1))
        return cls(fall / unit, axes.shape[1], -axes @ (axes.T @ vector) / size, sd / size)

    def is_sure(self, whole: _Fall, level: float) -> bool:
        """Whether it is significant, and nearly that of a completely free camera."""
        chance = _photocore.chi_square(self.value, float(self.freedom)) if self.freedom else 1.0
        return chance < level and self.value > EXPLAINED * whole.value


def lens_hints(result: Result) -> list[Message]:
    """Return hints on film cameras whose given lens is contradicted in a known way."""
    of_photos = result.block.photo_cameras
    if of_photos is None or result.loss is not None:
        return []
    rows = sorted({int(of_photos[row]) for row, _ in result.films})
    found = (_contradiction(result, result.cameras[row], CHANCE / (2 * len(rows))) for row in rows)
    return [Message(each) for each in found if each is not None]


def _contradiction(result: Result, camera: AdjustedCamera, level: float) -> Phrase | None:
    weighted = camera.weighted
    if not weighted or not np.isfinite(camera.cofactors[np.ix_(weighted, weighted)]).all():
        return None
    whole = _Fall.of(result, camera, weighted, np.eye(len(weighted)))
    values = camera.given.values
    radial = [k for k in weighted if RADIAL.fullmatch(camera.names[k]) and values[k]]
    point = [k for k in weighted if camera.names[k] in POINT]
    if radial:
        turned = _Fall.of(result, camera, radial, -2.0 * values[radial, np.newaxis])
        if turned.is_sure(whole, level):
            return _of_sign(camera, 1.0 - 2.0 * float(turned.moved[0]), 2.0 * float(turned.sd[0]))
    if len(point) == len(POINT):
        shifted = _Fall.of(result, camera, point, np.eye(2))
        if shifted.is_sure(whole, level) and shifted.freedom == len(point):
            return _of_point(camera, values[point], shifted)
    return None


def _of_sign(camera: AdjustedCamera, times: float, sd: float) -> Phrase | None:
    if abs(times + 1.0) > max(NEAR, WITHIN * sd):
        return None
    return phrase("film-lens.sign", camera=camera.name, times=times, sd=sd)


def _of_point(camera: AdjustedCamera, given: Floats, fall: _Fall) -> Phrase:
    """Return the observed principal point, and the probable mistake in the given one."""
    found = given + fall.moved
    size = float(np.hypot(*given))
    opposite = (np.abs(found + given) < WITHIN * fall.sd).all() and size > WITHIN * float(fall.sd.max())
    code = "signs" if opposite else "indicated" if size < 1e-3 else "point"
    fields = dict(
        zip(("x", "y", "sd_x", "sd_y", "given_x", "given_y"), [*found, *fall.sd, *given], strict=True)
    )
    return phrase(
        f"film-lens.{code}", camera=camera.name, **{name: float(value) for name, value in fields.items()}
    )
