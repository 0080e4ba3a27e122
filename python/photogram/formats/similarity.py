"""The similarity between two sets of points, in closed form."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats

__all__ = ["similarity"]


def similarity(model: Floats, targets: Floats) -> tuple[float, Floats, Floats, float]:
    """Return scale, rotation, shift and rms misfit of the similarity between points (Umeyama 1991)."""
    middle, aim = model.mean(axis=0), targets.mean(axis=0)
    a, b = model - middle, targets - aim
    with np.errstate(over="ignore", invalid="ignore"):
        products = b.T @ a
    if not np.isfinite(products).all():
        return 1.0, np.eye(3), np.zeros(3), np.inf
    u, s, vt = np.linalg.svd(products)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt)) or 1.0])
    if s[1] < 1e-9 * s[0] or not s[0] > 0:
        return 1.0, np.eye(3), np.zeros(3), np.inf
    turn = (u * signs) @ vt
    scale = float((s * signs).sum() / (a**2).sum())
    left = b - scale * a @ turn.T
    return scale, turn, aim - scale * turn @ middle, float(np.sqrt(np.mean(left**2)))
