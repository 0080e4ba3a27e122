"""What the data say of a calibrated camera: whether fx is fy, and which terms of its lens they show.

A group of k parameters x with the cofactors Q is tested by F = x' Q^-1 x / (k m^2) against Fisher's
distribution of k and f degrees of freedom (A. Wald's test; for one parameter Student's t squared). Terms are
left out backwards, the least significant group first, under the condition that those left out before are
zero; the level is that of all groups together (Bonferroni).
"""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.sky_cameras import SkyCamera

__all__ = ["LEVEL", "LensTest", "equal", "test_scale", "test_terms"]


LEVEL = 0.01
"""Probability that terms that are zero are kept."""
NOTABLE = 0.2
"""Standard deviations of an image coordinate that a term has to be worth somewhere in the frame."""
_GRID = 9


@dataclass(frozen=True)
class LensTest:
    """A test of parameters of the lens.

    Attributes
    ----------
    name
        What is tested to be zero: `fx - fy`, `k3`, `p1, p2`.
    statistic
        F with `dimension` and `freedom` degrees of freedom.
    dimension, freedom
        Of the statistic.
    probability
        Of a statistic as large if it is zero.
    level
        Probability below which it is not zero.
    effect
        Largest displacement that it makes in the frame, pixels.
    notable
        Whether that is more than a fifth of the standard deviation of an image coordinate.
    """

    name: str
    statistic: float
    dimension: int
    freedom: int
    probability: float
    level: float
    effect: float
    notable: bool

    @property
    def significant(self) -> bool:
        """Whether the data show that it is not zero."""
        return self.probability < self.level

    @property
    def needed(self) -> bool:
        """Whether it is not zero, and large enough to matter."""
        return self.significant and self.notable

    @property
    def verdict(self) -> str:
        """What to do about it, in words."""
        if self.needed:
            return "needed"
        return "not zero, but too small to matter" if self.significant else "not shown by the data"


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
    """Test whether fx is fy; None where the two were not estimated both.

    Parameters
    ----------
    camera
        Calibrated.
    freedom
        Degrees of freedom of its mean error of unit weight.
    frame
        Width and height, pixels.
    pixel_sd
        Standard deviation of an image coordinate, pixels.
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
    """Test the groups of lens terms backwards; those left out come first, in their order.

    Parameters
    ----------
    camera, freedom, frame, pixel_sd
        As for `test_scale`.
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
    level, left_out, kept = LEVEL / len(groups), [], []
    while groups:
        tests = []
        for group in groups:
            statistic, probability = _fisher(values[group], covariance[np.ix_(group, group)], freedom)
            moved = np.linalg.norm(by_terms[:, :, group] @ values[group], axis=1)
            effect = float(moved.max(initial=0.0))
            title = ", ".join(names[i] for i in group)
            tests.append(
                LensTest(
                    title,
                    statistic,
                    len(group),
                    freedom,
                    probability,
                    level,
                    effect,
                    effect > NOTABLE * pixel_sd,
                )
            )
        candidates = [k for k, test in enumerate(tests) if not test.needed]
        if not candidates:
            kept = tests
            break
        least = max(candidates, key=lambda k: tests[k].probability)
        left_out.append(tests[least])
        out = groups.pop(least)
        # What is zero conditions the others.
        gain = covariance[:, out] @ np.linalg.inv(covariance[np.ix_(out, out)])
        values = values - gain @ values[out]
        covariance = covariance - gain @ covariance[out, :]
    return [*left_out, *kept]
