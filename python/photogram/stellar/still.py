"""Whether a camera on a tripod stood still: the attitudes of its exposures against each other.

Given the camera, the attitudes a_i of exposures are independent of each other; what they share is its error.
With the cofactors C of the camera and C_i between attitude and camera, B_i = C_i C^-1, the attitudes have the
covariance S = diag(S_i - B_i C_i') + B C B'. The sum of squares d' S^-1 d about their weighted mean is
chi-squared with 3 (E - 1) degrees of freedom, that of one exposure against the mean of the others with 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.stellar.skies import SkyCalibration

__all__ = ["LEVEL", "Standstill", "stood_still"]


LEVEL = 0.05
"""Probability that any exposure of a camera that stood still is named."""


@dataclass(frozen=True, eq=False)
class Standstill:
    """The test of a camera that is said to have stood still.

    Attributes
    ----------
    statistic, dimension, probability
        Of all attitudes about their mean: chi-squared.
    own
        (E,) probability of the difference of each exposure from the others.
    turns
        (E,) the turn of each against the mean of the others, radians.
    """

    statistic: float
    dimension: int
    probability: float
    own: Floats
    turns: Floats

    @property
    def moved(self) -> list[int]:
        """Exposures that differ from the others (Bonferroni over all), the worst first."""
        beyond = np.flatnonzero(self.own < LEVEL / max(1, len(self.own)))
        return [int(k) for k in beyond[np.argsort(self.own[beyond], kind="stable")]]


def stood_still(found: SkyCalibration) -> Standstill | None:
    """Test whether all attitudes are one; None of a single exposure, and where there is no mean error."""
    count = len(found.attitudes)
    if count < 2 or found.degrees_of_freedom < 1:
        return None
    known = np.flatnonzero(found.camera.known)
    covariance = _covariance(found, known)
    # Angles near each other in spite of full turns.
    first = found.attitudes[0]
    angles = first + np.remainder(found.attitudes - first + np.pi, 2 * np.pi) - np.pi
    design = np.tile(np.eye(3), (count, 1))
    statistic, _ = _about_mean(angles.ravel(), covariance, design)
    own, turns = np.ones(count), np.zeros(count)
    for number in range(count):
        mine = np.arange(3 * number, 3 * number + 3)
        rest = np.setdiff1d(np.arange(3 * count), mine)
        left, _ = _about_mean(angles.ravel()[rest], covariance[np.ix_(rest, rest)], design[rest])
        own[number] = _photocore.chi_square(max(statistic - left, 0.0), 3.0, upper=True)
        others = np.delete(angles, number, axis=0).mean(axis=0)
        matrix = _photocore.pointing_matrix(angles[number]) @ _photocore.pointing_matrix(others).T
        turns[number] = np.linalg.norm(_photocore.rotation_vectors(matrix[None])[0])
    dimension = 3 * (count - 1)
    probability = _photocore.chi_square(statistic, float(dimension), upper=True)
    return Standstill(statistic, dimension, probability, own, turns)


def _covariance(found: SkyCalibration, known: np.ndarray) -> Floats:
    """Return (3 E, 3 E) of all attitudes."""
    count = len(found.attitudes)
    camera = found.camera.covariance[np.ix_(known, known)]
    shared = found.cross_covariances[:, :, known].reshape(3 * count, len(known))
    scale = np.sqrt(np.diag(camera))
    inverse = np.linalg.inv(camera / np.outer(scale, scale)) / np.outer(scale, scale)
    by_camera = shared @ inverse @ shared.T
    whole = by_camera.copy()
    for number in range(count):
        mine = slice(3 * number, 3 * number + 3)
        whole[mine, mine] = found.attitude_covariances[number]
    return np.asarray(whole, float)


def _about_mean(values: Floats, covariance: Floats, design: Floats) -> tuple[float, Floats]:
    """Return the sum of squares of values about their weighted mean, and the mean."""
    weight = np.linalg.inv(covariance)
    mean = np.linalg.solve(design.T @ weight @ design, design.T @ weight @ values)
    off = values - design @ mean
    return float(off @ weight @ off), np.asarray(mean, float)
