"""Which lens a camera has: every candidate is adjusted to the same images of stars.

Lenses that are not special cases of each other are compared by G. Schwarz's criterion (Ann. Stat. 6, 1978),
BIC = n ln(Omega / n) + k ln n, with the weighted sum of squares Omega of the images that all of them keep, k
parameters of the camera and n = degrees of freedom + k: attitudes eat observations, and do not count. A
difference above 10 is decisive, above 2 positive; below, the lens with fewer parameters is taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from photogram.arguments.types import Bools
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.places import Earth
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure, SkyCalibration, calibrate_exposures
from photogram.stellar.sky_cameras import SkyCamera

__all__ = ["DECISIVE", "POSITIVE", "LensFit", "as_lens", "compared_lenses"]


DECISIVE, POSITIVE = 10.0, 2.0
"""Differences of BIC."""
_ROUNDS = 10


@dataclass(frozen=True)
class LensFit:
    """A lens that was tried.

    Attributes
    ----------
    lens
        Its name.
    parameters
        How many parameters of the camera were estimated.
    images
        Images that it was compared on.
    mean_error
        Mean error of unit weight; NaN where it was not adjusted.
    bic
        Schwarz's criterion; infinite where it was not adjusted.
    reason
        Why it was not adjusted.
    """

    lens: str
    parameters: int
    images: int
    mean_error: float
    bic: float
    reason: str = ""


def as_lens(camera: SkyCamera, lens: str, frame: tuple[float, float]) -> SkyCamera:
    """Return an ideal camera of another lens with the same horizontal field of view.

    Raises
    ------
    InputError
        The lens does not see so much.
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
    """Adjust lenses to the same images.

    Parameters
    ----------
    lenses
        Their names.
    exposures
        With the stars of their images.
    camera
        To begin with.
    site, catalogue, pixel_sd, fixed, common_scale, earth, threads
        As for `calibrate_exposures`; of `fixed` what a lens has.
    frame
        Width and height, pixels.
    rejection
        Images with residuals larger by this than the robust standard deviation are left out; those that any
        lens leaves out are left out for all, but for lenses that hardly keep any.

    Returns
    -------
    The lenses, the best first, and the camera of the best.

    Raises
    ------
    AdjustmentError
        No lens can be adjusted.
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
