"""Choice of a lens model from stars, and significance tests of its terms.

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

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.agreement import quadratic
from photogram.stellar.sky_cameras import SkyCamera
from photogram.words import Phrase

LEVEL = 0.01  # Probability that zero terms are retained
NOTABLE = 0.2  # Notable displacement by a term (sd of an image coordinate)
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
        """Whether the parameters are significant and have a notable effect."""
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
    return LensTest("fx - fy", statistic, 1, freedom, probability, LEVEL, effect, effect > NOTABLE * pixel_sd)


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
    level = LEVEL / len(groups)
    removed: list[LensTest] = []
    while groups:
        tests = []
        for group in groups:
            f, probability = _fisher(values[group], covariance[np.ix_(group, group)], freedom)
            moved = np.linalg.norm(by_terms[:, :, group] @ values[group], axis=1)
            effect = float(moved.max(initial=0.0))
            title, notable = ", ".join(names[i] for i in group), effect > NOTABLE * pixel_sd
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
