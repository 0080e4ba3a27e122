"""Tests of lenses: which lens fits the stars best, and which of its terms are significant.

Every candidate is adjusted to the same images of stars (`photogram.stellar.night_calibration`). Lenses that
are not special cases of each other are compared by G. Schwarz's criterion (Ann. Stat. 6, 1978),
BIC = n ln(Omega / n) + k ln n, with the weighted sum of squares Omega of the images that all of them keep,
k parameters of the camera and n = degrees of freedom + k: parameters of attitudes reduce n and are not in k.
A difference above 10 is decisive, above 2 positive; below, the lens with fewer parameters is chosen.

Whether fx is fy, and which terms are significant: a group of k parameters x with the cofactors Q is tested by
F = x' Q^-1 x / (k m^2) against Fisher's distribution of k and f degrees of freedom (A. Wald's test; for one
parameter Student's t squared). Terms are removed backwards, the least significant group first, under the
condition that those removed before are zero; the level is that of all groups together (Bonferroni).
"""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.sky_cameras import SkyCamera
from photogram.words import Phrase

LEVEL = 0.01  # Probability that terms that are zero are kept
NOTABLE = 0.2  # Displacement by a term (sd of an image coordinate)
_GRID = 9
DECISIVE, POSITIVE = 10.0, 2.0  # Differences of BIC


@dataclass(frozen=True)
class LensTest:
    """A test of parameters of the lens."""

    name: str  # What is tested to be zero: `fx - fy`, `k3`, `p1, p2`
    statistic: float  # F with `dimension` and `freedom` degrees of freedom
    dimension: int  # Of the statistic
    freedom: int
    probability: float  # Of a statistic as large if it is zero
    level: float  # Probability below which it is not zero
    effect: float  # Largest displacement that it makes in the frame, pixels
    notable: bool  # Whether that is more than a fifth of the standard deviation of an image coordinate

    @property
    def significant(self) -> bool:
        """Whether it differs significantly from zero."""
        return self.probability < self.level

    @property
    def needed(self) -> bool:
        """Whether it is significant and large enough to matter."""
        return self.significant and self.notable

    @property
    def verdict(self) -> str:
        """The outcome in words."""
        if self.needed:
            return "needed"
        return "not zero, but too small to matter" if self.significant else "not shown by the data"


@dataclass(frozen=True)
class LensFit:
    """A lens that was adjusted, or the reason why it could not be."""

    lens: str
    parameters: int  # Estimated parameters of the camera
    images: int  # Images that all lenses are compared by
    mean_error: float  # Mean error of unit weight; NaN without an adjustment
    bic: float  # Schwarz's criterion; infinite without an adjustment
    reason: str | Phrase = ""


def _fisher(change: Floats, covariance: Floats, freedom: int) -> tuple[float, float]:
    """Return F of parameters with their covariance (scaled by m^2), and its probability."""
    scale = np.sqrt(np.diag(covariance))
    scaled = change / scale
    found = float(scaled @ np.linalg.solve(covariance / np.outer(scale, scale), scaled)) / len(change)
    return found, _photocore.fisher(found, float(len(change)), float(freedom))


def equal(values: Floats, covariance: Floats, freedom: int) -> tuple[float, float]:
    """Return F of the difference of two values with their covariance (2, 2), and its probability.

    F has 1 and `freedom` degrees of freedom, those of the unit weight that scales the covariance.
    """
    (xx, xy), (_, yy) = covariance
    return _fisher(np.array([values[0] - values[1]]), np.array([[xx + yy - 2 * xy]]), freedom)


def test_scale(
    camera: SkyCamera, freedom: int, frame: tuple[float, float], pixel_sd: float
) -> LensTest | None:
    """Test whether fx is fy; None if they were not both estimated.

    `freedom` are the degrees of freedom of the mean error of unit weight; frame and deviation are in pixels.
    """
    if not (camera.known[:2].all() and freedom > 0):
        return None
    statistic, probability = equal(camera.values[:2], camera.covariance[:2, :2], freedom)
    difference = camera.values[0] - camera.values[1]
    # Half of it goes into each axis.
    reach = 0.5 * max(frame) / float(np.mean(camera.values[:2]))
    effect = 0.5 * abs(float(difference)) * reach
    return LensTest("fx - fy", statistic, 1, freedom, probability, LEVEL, effect, effect > NOTABLE * pixel_sd)


def test_terms(
    camera: SkyCamera, freedom: int, frame: tuple[float, float], pixel_sd: float
) -> list[LensTest]:
    """Test the groups of lens terms backwards as `test_scale`; removed terms come first, in their order."""
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
