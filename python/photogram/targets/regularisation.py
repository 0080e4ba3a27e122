"""Camera priors of a calibration: knots observed as zero, or weak observations of mrcal 2.2.

The latter observe lens terms as 0 and the principal point as central. Let n = 2 (corners of
the board) (images), including missing corners, and n_d the number of lens terms of all cameras:

    lambda p = 0,  lambda^2 = 0.0025 n / (4 n_d)         every lens term; 5 lambda for k4, k5, k6
    mu (cx - (w - 1)/2) = 0,  mu^2 = 0.0025 n / (2 K 500^2)       likewise cy; K cameras

and, of splined lenses, with n_d displacements of knots, lambda^2 = 0.0025 n / (0.04 n_d):

    lambda (e . d) = 0,  10 lambda (e x d) = 0        e: radial; (1, 0) at the centre, lambda for both

These are rows of unit weight in pixels, independent of the corner standard deviation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import argument_error
from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.network.passages import KNOTTED
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.network.block import Block
    from photogram.targets import Calibration

CORE = ("fx", "fy", "f", "cx", "cy")
DENOMINATOR = ("k4", "k5", "k6")
SHARE, ROUGH, FAR = 0.0025, 4.0, 500.0
FIRMER = 5.0
ROUGH_KNOTS, ACROSS = 0.04, 10.0


def regularised(
    cameras: Sequence[Camera], sizes: Sequence[tuple[int, int] | None], observed: int
) -> list[Camera]:
    terms = [[name for name in each.names if name not in CORE and _free(each, name)] for each in cameras]
    count = sum(map(len, terms))
    mu = math.sqrt(SHARE * observed / (2 * len(cameras) * FAR**2))
    knots = sum(len(each.knot_names) for each in cameras if each.knot_unknowns)
    found = []
    for camera, size, own in zip(cameras, sizes, terms, strict=True):
        if size is None:
            raise InputError(phrase("targets.no-size", camera=camera.title))
        firm = math.sqrt(SHARE * observed / (ROUGH * count)) if count else math.inf
        priors = {name: (0.0, 1 / (firm * (FIRMER if name in DENOMINATOR else 1.0))) for name in own}
        priors |= {
            name: ((extent - 1) / 2, 1 / mu)
            for name, extent in zip(("cx", "cy"), size, strict=True)
            if _free(camera, name)
        }
        values = {name: value for name, (value, _) in priors.items()}
        sd = {name: each for name, (_, each) in priors.items()}
        given = dict(zip(camera.names, camera.deviations.tolist(), strict=True))
        knot_sd = camera.knot_sd
        if camera.knot_unknowns and camera.knots is not None:
            firm = math.sqrt(SHARE * observed / (ROUGH_KNOTS * knots))
            rows, columns, _ = camera.knots.shape
            knot_sd = np.tile([1 / firm, 1 / (ACROSS * firm)], (rows, columns, 1))
            if rows % 2 and columns % 2:  # the central knot has an undefined radial direction
                knot_sd[rows // 2, columns // 2] = 1 / firm
        found.append(
            camera.replace(parameters={**camera.parameters, **values}, sd={**given, **sd}, knot_sd=knot_sd)
        )
    return found


def weighted_block(start: Calibration) -> Block:
    if start.regularise is None:
        return start.block()
    observed = 2 * len(start.board.places) * len(start.corners.pictures)
    return start.block(regularised(start.cameras, start.corners.sizes, observed))


def _free(camera: Camera, name: str) -> bool:
    return float(camera.deviations[camera.names.index(name)]) > 0


WEAK_KNOT_SD = (1.0, 0.1)  # radial, tangential in the stereographic image; 1 is 53 degrees off the axis


def with_knot_sd(
    cameras: Sequence[Camera], knot_sd: tuple[float, float] | None, regularise: str | None
) -> list[Camera]:
    """Return cameras whose free knots are observed as zero, radially and tangentially.

    `knot_sd` is by default `WEAK_KNOT_SD`, unless `regularise` names other priors.
    """
    if knot_sd is not None:
        if not all(0 < each < np.inf for each in knot_sd):
            raise argument_error("knot_sd", "positive-numbers", count=2, value=knot_sd)
        if regularise is not None:
            raise InputError(phrase("error.exclusive", first="knot_sd", second="regularise"))
        if not any(each.model == KNOTTED for each in cameras):
            raise InputError(phrase("error.not-applicable", name="knot_sd", other=cameras[0].model))
    if regularise is not None:
        return list(cameras)
    own = WEAK_KNOT_SD if knot_sd is None else knot_sd
    return [each.replace(knot_sd=own) if each.knot_unknowns else each for each in cameras]
