"""Exposures of which neither attitude nor field of view is known: found anywhere in the sky by `tetra3rs`.

The package (extra `stars`) finds patterns of four bright images in a data base of Gaia and Hipparcos,
without any attitude (S. Michael, https://tetra3rs.dev). What it finds is where the identification of this
package begins: stars, odds and adjustment are as they are for attitudes that were given. It knows central
perspectives only, so it finds what a lens without much distortion sees within some 60 degrees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.stellar.places import Earth, station_attitude
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure

ATTITUDE, FIELD = math.radians(1.5), 0.05
"""What attitudes and principal distances that are found so may be wrong: radians, and a share."""
_STEP = 1.3
"""From one field of view that is tried to the next; each reaches half way."""
_IMAGES = 200
"""Brightest images that are looked at."""
_SECONDS = 5000
_MAGNITUDES = (6.0, 9.0)
"""Faintest stars of the data base for fields of 40 degrees and more, and of 5 and less."""


@dataclass(frozen=True, eq=False)
class Located:
    """Where an exposure looks."""

    attitude: Floats  # (3,) alpha, omega, kappa, radians; NaN where it was not found
    field: float  # Horizontal field of view, radians; NaN where it was not found
    # Whether its images are found only when they are mirrored: then there is no attitude
    mirrored: bool = False

    @property
    def found(self) -> bool:
        """Whether there is an attitude."""
        return bool(np.isfinite(self.attitude).all())

    def reason(self) -> str:
        """Say why there is none."""
        return (
            "its images are mirrored (x counts right, y down)"
            if self.mirrored
            else "its images are found nowhere in the sky, with no field of view that was tried"
        )


_NOWHERE = Located(np.full(3, np.nan), math.nan)


def locate(
    exposures: Sequence[Exposure],
    site: Site,
    frame: tuple[float, float],
    fields: tuple[float, float],
    earth: Earth | None = None,
) -> list[Located]:
    """Find where exposures look, whose images stand with the brightest first; attitudes do not count.

    The frame is in pixels; fields are the smallest and largest horizontal field of view that the camera may
    have, radians.

    Raises InputError: fields of view that cannot be. ModuleNotFoundError: tetra3rs is not installed.
    """
    low, high = (math.degrees(field) for field in fields)
    if not 0.5 <= low <= high <= 100:
        raise InputError(
            f"fields of view are looked for from 0.5 to 100 degrees, not from {low:g} to {high:g} degrees"
        )
    base = _database(low, high)
    count = max(1, math.ceil(math.log(high / low) / math.log(_STEP)))
    tried = [low * (high / low) ** ((k + 0.5) / count) for k in range(count)]
    found = []
    for exposure in exposures:
        located = _located(base, exposure, site, frame, tried, earth or Earth())
        if located.found:
            # One camera took them all: its field of view comes first.
            tried.sort(key=lambda field: abs(math.log(math.radians(field) / located.field)))
        found.append(located)
    return found


@lru_cache(maxsize=2)
def _database(low: float, high: float) -> Any:
    """Make the data base of patterns, which takes a second."""
    import tetra3rs

    faint, bright = math.log(5.0), math.log(40.0)
    share = min(1.0, max(0.0, (bright - math.log(low)) / (bright - faint)))
    magnitude = _MAGNITUDES[0] + share * (_MAGNITUDES[1] - _MAGNITUDES[0])
    return tetra3rs.SolverDatabase.generate_from_gaia(
        None, max_fov_deg=high * math.sqrt(_STEP), min_fov_deg=low, star_max_magnitude=magnitude
    )


def _located(
    base: Any,
    exposure: Exposure,
    site: Site,
    frame: tuple[float, float],
    fields: Sequence[float],
    earth: Earth,
) -> Located:
    xy = exposure.xy[:_IMAGES] - 0.5 * np.array(frame)
    # The order is that of brightness.
    images = np.column_stack([xy, np.arange(len(xy), 0, -1.0)])
    mirrored = False
    for field in fields:
        solved = base.solve_from_centroids(
            images,
            fov_estimate_deg=field,
            fov_max_error_deg=field * (math.sqrt(_STEP) - 1),
            image_width=round(frame[0]),
            image_height=round(frame[1]),
            solve_timeout_ms=_SECONDS,
        )
        if not solved:
            continue
        if solved.parity_flip:
            mirrored = True
            continue
        matrix = np.asarray(solved.rotation_matrix_icrs_to_camera, float)
        attitude = station_attitude(matrix, site, exposure.utc, earth)
        return Located(attitude, math.radians(solved.fov_deg))
    return replace(_NOWHERE, mirrored=mirrored)
