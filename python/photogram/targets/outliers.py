"""Outliers as mrcal marks them: only to reproduce its results.

Snooping tests each corner by its own accuracy.
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools
from photogram.results.result import Result

__all__ = ["marked_as_mrcal"]

ANY, TAKEN = 5.0, 4.0
"""Times the rms of all: beyond the first a coordinate calls for action, beyond the second corners go."""


def marked_as_mrcal(result: Result) -> Bools:
    """Return (m,) which images are taken out.

    None, unless a weighted residual is beyond 5 rms of all; then those with one beyond 4.
    """
    weighted = np.abs(result.residuals / result.image_given_sd)
    rms = np.sqrt(np.nanmean(weighted**2))
    far = np.nanmax(weighted, axis=1, initial=0.0)
    return far > TAKEN * rms if (far > ANY * rms).any() else np.zeros(len(far), dtype=bool)
