"""Exposures with unknown attitude and field of view, located on the whole sky by `tetra3rs`.

The package (extra `stars`) finds patterns of four bright images in a database of Gaia and Hipparcos, without
any attitude (S. Michael, https://tetra3rs.dev). Its results are initial values of the identification. Stars,
odds and adjustment are then the same as for given attitudes. The package supports only central perspectives,
that is, lenses without much distortion within some 60 degrees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.places import station_attitude
from photogram.stellar.sky_calibration import Exposure
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.stellar import Night

ATTITUDE_ERROR, FIELD_ERROR = math.radians(1.5), 0.05
"""Largest errors of attitudes (radians) and of the principal distance (relative)."""
_STEP = 1.3  # Ratio of consecutive fields of view; each covers half of the distance to the next
_MAX_IMAGES = 200
_TIMEOUT_MS = 5000
_MAGNITUDES = (6.0, 9.0)  # Faintest stars for fields of 40 and of 5 degrees


@dataclass(frozen=True, eq=False)
class Located:
    """Located direction of an exposure."""

    attitude: Floats  # (3,) alpha, omega, kappa, radians
    field: float  # Horizontal field of view, radians; NaN if the exposure was not found
    reason: Phrase | None = None  # Reason of a failure


def locate(exposures: Sequence[Exposure], night: Night, fields: tuple[float, float]) -> list[Located]:
    """Locate exposures, whose images are sorted by brightness; attitudes are not used.

    `fields` are the smallest and largest horizontal field of view, radians.

    InputError: if fields of view are out of range. ModuleNotFoundError: if tetra3rs is not installed.
    """
    low, high = (math.degrees(field) for field in fields)
    if not 0.5 <= low <= high <= 100:
        raise InputError(phrase("stars.blind-fields", low=low, high=high))
    base = _database(low, high)
    count = max(1, math.ceil(math.log(high / low) / math.log(_STEP)))
    tried = [low * (high / low) ** ((k + 0.5) / count) for k in range(count)]
    directions = []
    for exposure in exposures:
        located = _located(base, exposure, night, tried)
        if located.reason is None:
            # All exposures have one camera: its field of view is tested first.
            tried.sort(key=lambda field: abs(math.log(math.radians(field) / located.field)))
        directions.append(located)
    return directions


@lru_cache(maxsize=2)
def _database(low: float, high: float) -> Any:
    import tetra3rs

    faint, bright = math.log(5.0), math.log(40.0)
    share = min(1.0, max(0.0, (bright - math.log(low)) / (bright - faint)))
    magnitude = _MAGNITUDES[0] + share * (_MAGNITUDES[1] - _MAGNITUDES[0])
    return tetra3rs.SolverDatabase.generate_from_gaia(
        None, max_fov_deg=high * math.sqrt(_STEP), min_fov_deg=low, star_max_magnitude=magnitude
    )


def _located(base: Any, exposure: Exposure, night: Night, fields: Sequence[float]) -> Located:
    width, height = night.frame
    xy = exposure.xy[:_MAX_IMAGES] - 0.5 * np.array(night.frame)
    # The weights decrease in the order of brightness.
    images = np.column_stack([xy, np.arange(len(xy), 0, -1.0)])
    mirrored = False
    for field in fields:
        solved = base.solve_from_centroids(
            images,
            fov_estimate_deg=field,
            fov_max_error_deg=field * (math.sqrt(_STEP) - 1),
            image_width=round(width),
            image_height=round(height),
            solve_timeout_ms=_TIMEOUT_MS,
        )
        if not solved:
            continue
        if solved.parity_flip:
            mirrored = True
            continue
        matrix = np.asarray(solved.rotation_matrix_icrs_to_camera, float)
        attitude = station_attitude(matrix, night.site, exposure.utc, night.earth)
        return Located(attitude, math.radians(solved.fov_deg))
    return Located(np.full(3, math.nan), math.nan, phrase("stars.mirrored" if mirrored else "stars.nowhere"))
