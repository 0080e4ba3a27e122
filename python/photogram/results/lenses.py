"""What a lens that is given wrongly would explain of the residuals of a block, and how it is estimated."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.motion import focal_images
from photogram.results.fixed_tests import is_suspected
from photogram.results.group_sums import factored
from photogram.results.result import Result
from photogram.results.scores import score

__all__ = ["fall_by_lens", "how_to_calibrate", "lens_partials", "usual_parameters"]

_USUAL = ("f", "fx", "fy", "c", "cx", "cy", "xp", "yp", "k", "k1", "k2", "p1", "p2", "a1", "a2")
"""Principal distance and point, two radial and two tangential terms, under the names of all models."""


def fall_by_lens(result: Result, images: Bools) -> float:
    """Return by how much the weighted sum of squares would fall with a lens of its own; 0 where not known.

    Rao's score (:mod:`photogram.results.scores`) of radial and tangential terms, principal point and distance
    about the middle of the frame, whatever the model of the camera has; of the radial terms alone where
    unknowns take up others.

    Parameters
    ----------
    result
        The adjustment.
    images
        (m,) those of the camera.
    """
    if result.loss or not result.WHOLE or not is_suspected(result):
        return 0.0
    block, own = result.block, images & result.used_images
    columns = lens_partials(result, own)
    used = result.used_images[:, np.newaxis]
    residuals: Floats = np.where(used, result.residuals / block.image_sd, 0.0)
    factor = factored(result)
    for count in (len(columns), 4, 2):
        if (found := score(factor, columns[:count], residuals)) is not None:
            return found
    return 0.0


def lens_partials(result: Result, own: Bools) -> Floats:
    """(7, m, 2) partials of the images that are `own` by what a lens may have, in standard deviations."""
    block = result.block
    xy = focal_images(block)[own]
    low, high = xy.min(axis=0), xy.max(axis=0)
    x, y = ((xy - (low + high) / 2) / max(float((high - low).max()) / 2, 1e-300)).T
    r2, zero, one = x * x + y * y, np.zeros_like(x), np.ones_like(x)
    terms = [
        *((x * r2, y * r2), (x * r2**2, y * r2**2)),
        *((r2 + 2 * x * x, 2 * x * y), (2 * x * y, r2 + 2 * y * y)),
        *((x, y), (one, zero), (zero, one)),
    ]
    columns = np.zeros((len(terms), *block.image_xy.shape))
    columns[:, own] = np.array(terms).transpose(0, 2, 1) / block.image_sd[own]
    return columns


def usual_parameters(camera: Camera) -> list[str]:
    """Return the parameters of a camera that are held and commonly are not known."""
    held = dict(zip(camera.names, camera.deviations.tolist(), strict=True))
    return [
        name
        for name in camera.names
        if name.lower() in _USUAL and held[name] == 0 and name not in camera.constants
    ]


def how_to_calibrate(block: Block) -> str:
    """Return the option that estimates the cameras of a block, as words; nothing where nothing is left."""
    if not any(len(camera.names) > 1 for camera in block.cameras):
        return "a camera with distortion in place of the principal distance, and --self-calibrate all"
    names = dict.fromkeys(
        "f" if name in ("fx", "fy") else name for camera in block.cameras for name in usual_parameters(camera)
    )
    return f"--self-calibrate {','.join(names)}" if names else ""
