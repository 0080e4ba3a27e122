"""The camera of a star plate as blocks take it."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.network.cameras import Camera
from photogram.stellar.parameters import NAMES, UNITS

_INTERIOR = NAMES[9:22]
_IN_MODEL = {"cx": "c", "cy": "c_y"}
_METRE = 1000.0
"""In mm, which plates have in blocks."""


def plate_camera(
    values: Floats,
    covariance: Floats,
    name: str = "",
    *,
    weighted: bool = True,
    common_scale: bool = False,
    distortion_first: float = 0.0,
) -> Camera:
    """Return a camera of star plates as blocks take it: `plate`, in mm.

    The model has the parameters of the calibration, (13,) epsilon, xp, yp, cx, cy, dx, dy, K1 to K5, phi_T in
    radians and metres, so that values and covariance (13, 13) only change their units; variances of zero are
    those of what was held. Unless `weighted` what was calibrated is known, not observed. With a common scale
    cx is the principal distance of both axes; `distortion_first` is that (metres) of the form with scale
    after distortion, 0 for scale before distortion.
    """
    scale = np.array([_METRE ** _power(UNITS[each]) for each in _INTERIOR])
    values, covariance = values * scale, covariance * np.outer(scale, scale)
    if common_scale:
        values[_INTERIOR.index("cy")] = 0.0
    names = [_IN_MODEL.get(each, each) for each in _INTERIOR]
    parameters = dict(zip(names, values.tolist(), strict=True)) | {"c0": _METRE * distortion_first}
    known = np.flatnonzero(np.diag(covariance) > 0)
    if not (weighted and known.size):
        return Camera("plate", parameters, name=name)
    observed = [names[row] for row in known], covariance[np.ix_(known, known)]
    return Camera("plate", parameters, covariance=observed, name=name)


def _power(unit: str) -> int:
    """Return the power of the metre in the unit of a parameter."""
    return 0 if unit == "rad" else 1 if unit == "m" else int(unit.removeprefix("m^"))
