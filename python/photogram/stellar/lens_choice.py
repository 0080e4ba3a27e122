"""Which lens a camera has, and what of it the data show.

Every candidate is adjusted to the same images of stars. Lenses that are not special cases of each other are
compared by G. Schwarz's criterion (Ann. Stat. 6, 1978), BIC = n ln(Omega / n) + k ln n, with the weighted sum
of squares Omega of the images that all of them keep, k parameters of the camera and n = degrees of freedom +
k: attitudes eat observations, and do not count. A difference above 10 is decisive, above 2 positive; below,
the lens with fewer parameters is taken.

Whether fx is fy, and which terms the data show: a group of k parameters x with the cofactors Q is tested by
F = x' Q^-1 x / (k m^2) against Fisher's distribution of k and f degrees of freedom (A. Wald's test; for one
parameter Student's t squared). Terms are left out backwards, the least significant group first, under the
condition that those left out before are zero; the level is that of all groups together (Bonferroni).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.places import Earth
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure, SkyCalibration, calibrate_exposures
from photogram.stellar.sky_cameras import SkyCamera

LEVEL = 0.01
"""Probability that terms that are zero are kept."""
NOTABLE = 0.2
"""Standard deviations of an image coordinate that a term has to be worth somewhere in the frame."""
_GRID = 9


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


DECISIVE, POSITIVE = 10.0, 2.0
"""Differences of BIC."""
_ROUNDS = 10


@dataclass(frozen=True)
class LensFit:
    """A lens that was tried."""

    lens: str  # Its name
    parameters: int  # How many parameters of the camera were estimated
    images: int  # Images that it was compared on
    mean_error: float  # Mean error of unit weight; NaN where it was not adjusted
    bic: float  # Schwarz's criterion; infinite where it was not adjusted
    reason: str = ""  # Why it was not adjusted


def as_lens(camera: SkyCamera, lens: str, frame: tuple[float, float]) -> SkyCamera:
    """Return an ideal camera of another lens with the same horizontal field of view.

    Raises InputError: the lens does not see so much.
    """
    if lens == camera.lens:
        return camera
    left, right = camera.rays(np.array([[0.0, camera.values[3]], [frame[0], camera.values[3]]]))
    field = math.acos(max(-1.0, min(1.0, float(left[2])))) + math.acos(max(-1.0, min(1.0, float(right[2]))))
    return SkyCamera.of_field(*frame, field, lens)


def compared_lenses(
    lenses: Sequence[str],
    exposures: Sequence[Exposure],
    camera: SkyCamera,
    site: Site,
    catalogue: Catalogue,
    *,
    frame: tuple[float, float],
    pixel_sd: float,
    rejection: float,
    fixed: Sequence[str] = (),
    common_scale: bool = False,
    earth: Earth,
    threads: int | None = None,
) -> tuple[list[LensFit], SkyCamera]:
    """Adjust lenses to the same images; return them, the best first, and the camera of the best.

    `camera` is to begin with; the rest is as for `calibrate_exposures`, of `fixed` what a lens has. Images
    with residuals larger by `rejection` than the robust standard deviation are left out; those that any lens
    leaves out are left out for all, but for lenses that hardly keep any.

    Raises AdjustmentError: no lens can be adjusted.
    """

    def adjust(start: SkyCamera, images: Sequence[Exposure]) -> SkyCalibration:
        own = {name for name in fixed if name in start.names} | set(start.facts.held)
        return calibrate_exposures(
            images,
            start,
            site,
            catalogue,
            pixel_sd=pixel_sd,
            fixed=sorted(own),
            common_scale=common_scale,
            earth=earth,
            threads=threads,
        )

    tried: dict[str, tuple[SkyCamera, list[Bools]]] = {}
    failed: list[LensFit] = []
    for lens in lenses:
        try:
            found, kept = _settled(adjust, as_lens(camera, lens, frame), exposures, rejection)
        except (InputError, AdjustmentError) as error:
            failed.append(LensFit(lens, 0, 0, math.nan, math.inf, str(error)))
            continue
        tried[lens] = (found.camera, kept)
    if not tried:
        raise AdjustmentError("; ".join(f"{fit.lens}: {fit.reason}" for fit in failed))
    most = max(sum(int(each.sum()) for each in kept) for _, kept in tried.values())
    usual = [kept for _, kept in tried.values() if 2 * sum(int(each.sum()) for each in kept) > most]
    common = [np.logical_and.reduce(each) for each in zip(*usual, strict=True)]
    shared = [
        replace(exposure, stars=np.where(chosen, np.asarray(exposure.stars), -1))
        for exposure, chosen in zip(exposures, common, strict=True)
    ]
    fits, cameras = [], {}
    for lens, (start, _) in tried.items():
        try:
            found = adjust(start, shared)
        except (InputError, AdjustmentError) as error:
            failed.append(LensFit(lens, 0, 0, math.nan, math.inf, str(error)))
            continue
        fits.append(_fit(lens, found))
        cameras[lens] = found.camera
    if not fits:
        raise AdjustmentError("; ".join(f"{fit.lens}: {fit.reason}" for fit in failed))
    fits.sort(key=lambda fit: fit.bic)
    near = [fit for fit in fits if fit.bic - fits[0].bic < POSITIVE]
    best = min(near, key=lambda fit: (fit.parameters, fit.bic))
    fits.remove(best)
    return [best, *fits, *failed], cameras[best.lens]


def _settled(
    adjust: Callable[[SkyCamera, Sequence[Exposure]], SkyCalibration],
    camera: SkyCamera,
    exposures: Sequence[Exposure],
    rejection: float,
) -> tuple[SkyCalibration, list[Bools]]:
    """Adjust, and leave out images that are far from their stars, until none is."""
    now = list(exposures)
    found = adjust(camera, now)
    for _ in range(_ROUNDS if rejection else 0):
        far = np.abs(found.residuals).max(axis=1)
        limit = rejection * max(1.4826 * float(np.median(np.abs(found.residuals))), 1e-12)
        if not (far > limit).any():
            break
        for number, exposure in enumerate(now):
            stars = np.array(exposure.stars)
            chosen = np.flatnonzero(stars >= 0)
            stars[chosen[far[found.exposures == number] > limit]] = -1
            now[number] = replace(exposure, stars=stars, attitude=found.attitudes[number])
        found = adjust(found.camera, now)
    return found, [np.asarray(exposure.stars) >= 0 for exposure in now]


def _fit(lens: str, found: SkyCalibration) -> LensFit:
    count = int(found.camera.known.sum())
    effective = found.degrees_of_freedom + count
    total = found.mean_error**2 * found.degrees_of_freedom
    criterion = effective * math.log(max(total, 1e-300) / effective) + count * math.log(effective)
    return LensFit(lens, count, len(found.xy), found.mean_error, criterion)
