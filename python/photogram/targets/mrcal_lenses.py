"""Lenses of mrcal by their names: `LENSMODEL_OPENCV8`, `LENSMODEL_SPLINED_STEREOGRAPHIC_...`."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.network.knots import KNOTTED

__all__ = ["PREFIX", "freed", "lens_of_mrcal"]

PREFIX = "LENSMODEL_"
CORE = ("fx", "fy", "cx", "cy")
LENSES = {
    "PINHOLE": ("pinhole", 4),
    "STEREOGRAPHIC": ("stereographic", 4),
    **{f"OPENCV{terms}": ("opencv_pinhole", 4 + terms) for terms in (4, 5, 8, 12)},
    "CAHVOR": ("cahvor", 9),
}
"""Models by the name here, with as many of its parameters."""
SPLINED = re.compile(r"SPLINED_STEREOGRAPHIC_order=(\d+)_Nx=(\d+)_Ny=(\d+)_fov_x_deg=([\d.]+)")


def lens_of_mrcal(model: str, values: Sequence[float], name: str = "") -> Camera:
    """Return a camera, held, of its name and numbers in mrcal.

    Raises
    ------
    InputError
        A lens that is not taken, or another number of values.
    """
    said = model.removeprefix(PREFIX)
    if splined := SPLINED.fullmatch(said):
        order, nx, ny, fov = map(float, splined.groups())
        _count(model, values, 4 + 2 * int(nx) * int(ny))
        return Camera(
            KNOTTED,
            dict(
                zip((*CORE, "order", "nx", "ny", "fov_x_deg"), [*values[:4], order, nx, ny, fov], strict=True)
            ),
            name=name,
            knots=np.reshape(values[4:], (int(ny), int(nx), 2)),
        )
    if said not in LENSES:
        raise InputError(
            f"{model} is none of the lenses that are taken, {', '.join(LENSES)}, splined ones:"
            f" `mrcal-convert-lensmodel --sampled --intrinsics-only {PREFIX}OPENCV8 FILE` fits one that is"
        )
    own, count = LENSES[said]
    _count(model, values, count)
    names = Camera(own, dict.fromkeys(CORE, 1.0)).names[:count]
    return Camera(own, dict(zip(names, values, strict=True)), name=name)


def _count(model: str, values: Sequence[float], needed: int) -> None:
    if len(values) != needed:
        raise InputError(f"{model} has {needed} values, not {len(values)}")


def freed(camera: Camera, model: str, core: bool, lens: bool) -> Camera:
    """Return a camera of mrcal with what mrcal had free: the core, and the terms of the lens or its knots."""
    own = CORE if core else ()
    if camera.knots is not None:
        return camera.replace(sd=dict.fromkeys(own, math.inf), knot_sd=math.inf if lens else 0.0)
    terms = camera.names[4 : LENSES[model.removeprefix(PREFIX)][1]]
    return camera.replace(sd=dict.fromkeys((*own, *(terms if lens else ())), math.inf))
