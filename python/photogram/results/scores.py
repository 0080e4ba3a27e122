"""By how much the weighted sum of squares would fall with further unknowns (Rao's score; no adjustment)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from photogram import _photocore
    from photogram.arguments.types import Floats

__all__ = ["quadratic", "score"]

TAKEN_UP = 1e-9
"""Of the partials; what is left of them beside the unknowns is rounding below it."""


def score(factor: _photocore.BlockCovariances, partials: Floats, residuals: Floats) -> float | None:
    """Return T = c' C^-1 c with c = B' v and C = B' R B; None where the unknowns take the partials up.

    Parameters
    ----------
    factor
        Of the normal equations.
    partials
        (k, m, 2) B, in standard deviations of the images.
    residuals
        (m, 2) v, in standard deviations; zero where an image takes no part.
    """
    k = len(partials)
    size = np.einsum("kmi,kmi->k", partials, partials)
    if not (size > 0).all():
        return None
    projected = factor.project_images(partials, threads=0, progress=None)
    info = partials.reshape(k, -1) @ projected.reshape(k, -1).T
    info = (info + info.T) / 2
    if not (np.linalg.eigvalsh(info / np.sqrt(np.outer(size, size))) > TAKEN_UP).all():
        return None
    return quadratic(info, partials.reshape(k, -1) @ residuals.ravel())


def quadratic(matrix: Floats, vector: Floats) -> float:
    """Return x' M^-1 x, M scaled to unit diagonal before."""
    scale = np.sqrt(np.diag(matrix))
    scaled = vector / scale
    return float(scaled @ np.linalg.solve(matrix / np.outer(scale, scale), scaled))
