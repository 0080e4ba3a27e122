"""Whether a camera on a tripod stood still: the attitudes of its exposures against each other.

Given the camera, the attitudes a_i of exposures are independent of each other; what they share is its error.
With the cofactors C of the camera and C_i between attitude and camera, B_i = C_i C^-1, the attitudes have the
covariance S = diag(S_i - B_i C_i') + B C B'. The sum of squares d' S^-1 d about their weighted mean is
chi-squared with 3 (E - 1) degrees of freedom, that of one exposure against the mean of the others with 3.
"""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.sky_calibration import SkyCalibration

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
        (E,) probability of the difference of each exposure from the others; of those that moved, when they
        were found, of the rest without them.
    turns
        (E,) the turn of each against the mean of the others, radians.
    moved
        Exposures that differ from the others (Bonferroni over all), the worst first, each found without those
        before it.
    """

    statistic: float
    dimension: int
    probability: float
    own: Floats
    turns: Floats
    moved: tuple[int, ...]


def stood_still(found: SkyCalibration) -> Standstill | None:
    """Test whether all attitudes are one; None of a single exposure, and where there is no mean error."""
    count = len(found.attitudes)
    if count < 2 or found.degrees_of_freedom < 1:
        return None
    covariance = _covariance(found, np.flatnonzero(found.camera.known))
    # Angles near each other in spite of full turns.
    first = found.attitudes[0]
    angles = first + np.remainder(found.attitudes - first + np.pi, 2 * np.pi) - np.pi
    statistic = _about_mean(angles, covariance, list(range(count)))
    own, turns = np.ones(count), np.zeros(count)
    left, moved = list(range(count)), []
    while len(left) > 1:
        whole = _about_mean(angles, covariance, left)
        for number in left:
            others = [k for k in left if k != number]
            rest = _about_mean(angles, covariance, others)
            own[number] = _photocore.chi_square(max(whole - rest, 0.0), 3.0, upper=True)
            turns[number] = _turn(angles[number], angles[others].mean(axis=0))
        worst = min(left, key=lambda number: own[number])
        if own[worst] >= LEVEL / count:
            break
        moved.append(worst)
        left.remove(worst)
    dimension = 3 * (count - 1)
    probability = _photocore.chi_square(statistic, float(dimension), upper=True)
    return Standstill(statistic, dimension, probability, own, turns, tuple(moved))


def _turn(angles: Floats, others: Floats) -> float:
    """Return the turn between two attitudes, radians."""
    matrix = _photocore.pointing_matrix(angles) @ _photocore.pointing_matrix(others).T
    return float(np.linalg.norm(_photocore.rotation_vectors(matrix[None])[0]))


def _covariance(found: SkyCalibration, known: Indices) -> Floats:
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


def _about_mean(angles: Floats, covariance: Floats, chosen: list[int]) -> float:
    """Return the weighted sum of squares of some attitudes about their mean."""
    places = (3 * np.array(chosen)[:, None] + np.arange(3)).ravel()
    weight = np.linalg.inv(covariance[np.ix_(places, places)])
    design, values = np.tile(np.eye(3), (len(chosen), 1)), angles[chosen].ravel()
    mean = np.linalg.solve(design.T @ weight @ design, design.T @ weight @ values)
    off = values - design @ mean
    return float(off @ weight @ off)
