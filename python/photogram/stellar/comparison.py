"""Tests of each exposure of a night against the others, and of lenses and their terms.

Removal of an exposure changes the sum of squares by T = v'v + g'(N - S)^+ g. Its residuals over their
standard deviation are v, and g = C'v with its partials C by the camera. N is the information of the whole
night about the camera, and S the part from this exposure. T is the sum of squares with the camera and
covariance from the others, and only the attitude estimated. This needs no further adjustment (W. Baarda's
test of a group of observations, Netherlands Geodetic Commission 2, 5, 1968).

A second test shows whether a camera on a tripod moved. Given the camera, the attitudes a_i of exposures are
independent; they share the camera error. Let C be the cofactors of the camera, C_i those between attitude and
camera, and B_i = C_i C^-1. The attitudes have the covariance S = diag(S_i - B_i C_i') + B C B'. The sum of
squares d' S^-1 d about their weighted mean is chi-squared with 3 (E - 1) degrees of freedom. For one exposure
against the mean of the others it has 3.

Choice of a lens model from stars, and significance tests of its terms.

Every candidate is adjusted to the same star images (`photogram.stellar.night_calibration`). Lenses that are
not special cases of each other are compared by G. Schwarz's criterion (Ann. Stat. 6, 1978), BIC = n ln(Omega
/ n) + k ln n. Omega is the weighted sum of squares of the images used by all lenses. k is the number of
camera parameters, and n = degrees of freedom + k. Attitude parameters reduce n and are not in k. A difference
above 10 is decisive, above 2 positive; below, the lens with fewer parameters is chosen.

A group of k parameters x, such as fx - fy or lens terms, with the cofactors Q is tested by F = x' Q^-1 x / (k
m^2). F has Fisher's distribution of k and f degrees of freedom (A. Wald's test; for one parameter Student's t
squared). Terms are removed backwards, least significant group first, with the condition that removed terms
are zero. The level refers to all groups together (Bonferroni).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.agreement import quadratic
from photogram.statistics.fits import Fit
from photogram.stellar.identification import binomial_tail
from photogram.stellar.sky_calibration import Exposure, SkyCalibration, partials
from photogram.stellar.sky_cameras import SkyCamera
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.stellar import Night


LEVEL = 0.05  # Probability that any exposure of a correct night fails a test of all exposures


@dataclass(frozen=True, eq=False)
class Standstill:
    """Test of a common attitude of all exposures of a camera on a tripod."""

    statistic: float  # Chi-squared sum of all attitudes about their mean
    dimension: int
    probability: float
    # (E,) probability of the difference of each exposure from the others, without those with larger movements
    own: Floats
    turns: Floats  # (E,) rotation of each relative to the mean of the others, radians
    # Exposures that differ from the others (Bonferroni over all), largest difference first
    moved: tuple[int, ...]


def stood_still(found: SkyCalibration) -> Standstill | None:
    """Test whether all attitudes are equal; None if E is 1 or without redundancy."""
    count = len(found.attitudes)
    if count < 2 or found.degrees_of_freedom < 1:
        return None
    covariance = _covariance(found, np.flatnonzero(found.camera.known))
    # Remove full rotations between angles.
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
            turn = _photocore.pointing_matrix(angles[number])
            turn = turn @ _photocore.pointing_matrix(angles[others].mean(axis=0)).T
            turns[number] = np.linalg.norm(_photocore.rotation_vectors(turn[None])[0])
        worst = min(left, key=lambda number: own[number])
        if own[worst] >= LEVEL / count:
            break
        moved.append(worst)
        left.remove(worst)
    dimension = 3 * (count - 1)
    probability = _photocore.chi_square(statistic, float(dimension), upper=True)
    return Standstill(statistic, dimension, probability, own, turns, tuple(moved))


def _covariance(found: SkyCalibration, known: Indices) -> Floats:
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
    design = np.tile(np.eye(3), (len(chosen), 1))
    return Fit.of(angles[chosen].ravel(), covariance[np.ix_(places, places)], design).omega


NOTABLE = 2.0  # A smaller ratio to the prediction indicates only a less sharp exposure
_INVISIBLE = 1e-6  # Relative information about a direction below which the others do not determine it
_ATTITUDE = 3


def held_out(exposures: Sequence[Exposure], found: SkyCalibration, night: Night) -> tuple[Floats, Floats]:
    """Test each exposure, with adjusted attitudes, against the camera of the others.

    Return (E,) root mean squares of the residuals with that camera over the prediction from the others, NaN
    if these do not determine the camera, and (E,) probabilities with the unit weight of the others.
    """
    factors, probabilities = np.full(len(exposures), np.nan), np.ones(len(exposures))
    sd = np.sqrt(np.diag(found.camera.covariance))
    free = np.flatnonzero(sd > 0)
    unit, freedom = found.mean_error, found.degrees_of_freedom
    if not (freedom > 0 and unit > 0 and len(free)):
        return factors, probabilities
    scale, pixel_sd = sd[free] / unit, night.pixel_sd
    attitude, camera = partials(exposures, found.camera, night.site, night.catalogue, night.earth)
    camera = camera[:, :, free] * (scale / pixel_sd)
    attitude, residuals = attitude / pixel_sd, found.residuals / pixel_sd
    cofactors = found.camera.covariance[np.ix_(free, free)] / unit**2 / np.outer(scale, scale)
    # The square root of the cofactors normalises the information of the whole night to the unit matrix.
    values, vectors = np.linalg.eigh(cofactors)
    camera = camera @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    omega = unit**2 * freedom
    for number in range(len(exposures)):
        of = found.exposures == number
        rows = camera[of].reshape(-1, len(free)), attitude[of].reshape(-1, _ATTITUDE)
        total, rank = _held_out(*rows, residuals[of].ravel())
        left = freedom - rank
        if rank < 1 or left < 1:
            continue
        # The sum of the others is negative only if the model is nonlinear.
        variance = max(omega - total, 1e-12 * total) / left
        probabilities[number] = _photocore.chi_square(total / variance, float(rank), upper=True)
        factors[number] = np.sqrt(total / rank / variance)
    return factors, probabilities


def fewer_stars(images: Indices, matched: Indices) -> list[int]:
    """Return exposures with a significantly small star fraction, worst first.

    Their fraction of images with a star is less than half of the fraction in the other exposures. It must
    also be significant: the binomial probability is below 5 % for all exposures together. Both arguments are
    counts (E,).
    """
    found = []
    for number, (count, few) in enumerate(zip(images.tolist(), matched.tolist(), strict=True)):
        others = int(images.sum()) - count
        share = (int(matched.sum()) - few) / others if others else 0.0
        if few < 0.5 * share * count:
            # Number of images without a star, or more; the star fraction is small enough for the logarithmic
            # tail.
            probability = binomial_tail(count, 1.0 - share, count - few)
            if probability < LEVEL / len(images):
                found.append((few / (share * count), number))
    return [number for _, number in sorted(found)]


def _held_out(camera: Floats, attitude: Floats, residuals: Floats) -> tuple[float, int]:
    """Return T and its rank if the information of the whole night is the unit matrix."""
    base, _ = np.linalg.qr(attitude / np.maximum(np.linalg.norm(attitude, axis=0), 1e-300))
    own = camera - base @ (base.T @ camera)
    share, directions = np.linalg.eigh(np.eye(camera.shape[1]) - own.T @ own)
    seen = share > _INVISIBLE
    gradient = directions[:, seen].T @ (own.T @ residuals)
    total = float(residuals @ residuals + np.sum(gradient**2 / share[seen]))
    return total, len(residuals) - _ATTITUDE - int((~seen).sum())


TERM_LEVEL = 0.01  # Probability that zero terms are retained
NOTABLE_EFFECT = 0.2  # Notable displacement by a term (sd of an image coordinate)
_GRID = 9
DECISIVE, POSITIVE = 10.0, 2.0  # Differences of BIC


@dataclass(frozen=True)
class LensTest:
    name: str  # Hypothesis of zero: `fx - fy`, `k3`, `p1, p2`
    statistic: float  # F with `dimension` and `freedom` degrees of freedom
    dimension: int  # Degrees of freedom of the statistic
    freedom: int
    probability: float  # Probability of an equal or larger statistic if the parameters are zero
    level: float  # Probability below which the parameters are not zero
    effect: float  # Largest displacement in the frame by the parameters, pixels
    notable: bool  # Whether it is more than a fifth of the standard deviation of an image coordinate

    @property
    def significant(self) -> bool:
        return self.probability < self.level

    @property
    def needed(self) -> bool:
        return self.significant and self.notable

    @property
    def verdict(self) -> str:
        if self.needed:
            return "needed"
        return "not zero, but too small to matter" if self.significant else "not shown by the data"


@dataclass(frozen=True)
class LensFit:
    """Adjusted lens, or the reason of its failure."""

    lens: str
    parameters: int  # Estimated parameters of the camera
    images: int  # Images used to compare all lenses
    mean_error: float  # Mean error of unit weight; NaN without an adjustment
    bic: float  # Schwarz's criterion; infinite without an adjustment
    reason: str | Phrase = ""


def _fisher(change: Floats, covariance: Floats, freedom: int) -> tuple[float, float]:
    """Return F of parameters with covariance (scaled by m^2), and its probability."""
    found = quadratic(change, covariance)[0] / len(change)
    return found, _photocore.fisher(found, float(len(change)), float(freedom))


def equal(values: Floats, covariance: Floats, freedom: int) -> tuple[float, float]:
    """Return F of a difference of two values with covariance (2, 2), and probability.

    F has 1 and `freedom` degrees of freedom. The latter belong to the unit weight that scales the covariance.
    """
    (xx, xy), (_, yy) = covariance
    return _fisher(np.array([values[0] - values[1]]), np.array([[xx + yy - 2 * xy]]), freedom)


def test_scale(
    camera: SkyCamera, freedom: int, frame: tuple[float, float], pixel_sd: float
) -> LensTest | None:
    """Test whether fx equals fy; None if they were not both estimated.

    `freedom` is the redundancy of the mean error of unit weight; frame and deviation are in pixels.
    """
    if not (camera.known[:2].all() and freedom > 0):
        return None
    statistic, probability = equal(camera.values[:2], camera.covariance[:2, :2], freedom)
    difference = camera.values[0] - camera.values[1]
    # Half of it affects each axis.
    reach = 0.5 * max(frame) / float(np.mean(camera.values[:2]))
    effect = 0.5 * abs(float(difference)) * reach
    return LensTest(
        "fx - fy", statistic, 1, freedom, probability, TERM_LEVEL, effect, effect > NOTABLE_EFFECT * pixel_sd
    )


def test_terms(
    camera: SkyCamera, freedom: int, frame: tuple[float, float], pixel_sd: float
) -> list[LensTest]:
    """Test the groups of lens terms backwards as in `test_scale`.

    Removed terms are listed first, in order of removal.
    """
    names = list(camera.names)
    groups = [
        [names.index(name) for name in group if camera.known[names.index(name)]]
        for group in camera.facts.groups
    ]
    groups = [group for group in groups if group]
    if not (groups and freedom > 0):
        return []
    grid = np.stack(np.meshgrid(*(np.linspace(0, size, _GRID) for size in frame)), -1).reshape(-1, 2)
    rays = camera.rays(grid)
    by_terms = camera.partials(rays[np.isfinite(rays).all(axis=1)])
    values, covariance = camera.values.copy(), camera.covariance.copy()
    level = TERM_LEVEL / len(groups)
    removed: list[LensTest] = []
    while groups:
        tests = []
        for group in groups:
            f, probability = _fisher(values[group], covariance[np.ix_(group, group)], freedom)
            moved = np.linalg.norm(by_terms[:, :, group] @ values[group], axis=1)
            effect = float(moved.max(initial=0.0))
            title, notable = ", ".join(names[i] for i in group), effect > NOTABLE_EFFECT * pixel_sd
            tests.append(LensTest(title, f, len(group), freedom, probability, level, effect, notable))
        candidates = [k for k, test in enumerate(tests) if not test.needed]
        if not candidates:
            return [*removed, *tests]
        least = max(candidates, key=lambda k: tests[k].probability)
        removed.append(tests[least])
        zero = groups.pop(least)
        # The condition that these terms are zero changes the others.
        gain = covariance[:, zero] @ np.linalg.inv(covariance[np.ix_(zero, zero)])
        values = values - gain @ values[zero]
        covariance = covariance - gain @ covariance[zero, :]
    return removed
