"""Parameters of a plate calibration: names, units, order (NOAA TR NOS 55, section 4)."""

from __future__ import annotations

import math

GRAD = math.pi / 200.0
"""One grad in radians."""

GROUPS = ("pre", "post", "event")  # Image groups of one plate, each with its own attitude

INTERIOR = ("epsilon", "xp", "yp", "cx", "cy", "dx", "dy", "K1", "K2", "K3", "K4", "K5", "phi_T")
DISTORTION = INTERIOR[7:12]
TAU = ("tau1", "tau2", "tau3", "tau4")
COMMON = (*INTERIOR, *TAU)  # Parameters common to all images, in the order of the numerical core

NAMES = (*(f"{angle}_{group}" for group in GROUPS for angle in ("alpha", "omega", "kappa")), *COMMON)
"""All parameters in order: 22 of orientation and camera, 4 of refraction."""

INDEX = {name: index for index, name in enumerate(NAMES)}
"""Index of each parameter."""

UNITS = {
    **dict.fromkeys([*NAMES[:9], "epsilon", "phi_T"], "rad"),
    **dict.fromkeys(["xp", "yp", "cx", "cy", "dx", "dy"], "m"),
    "K1": "m^-2",
    "K2": "m^-4",
    "K3": "m^-6",
    "K4": "m^-1",
    "K5": "m^-3",
    **dict.fromkeys(TAU, "arcsec"),
}
"""Unit of each parameter."""

SIGNIFICANT = 1.96  # Critical ratio of distortion terms and their mean error (5 % level)
