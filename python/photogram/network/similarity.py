"""Similarity transformation between two sets of points, in closed form (S. Umeyama, IEEE PAMI 13, 1991)."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats

LINE = 1e-9  # Points with a smaller ratio of extents across and along a line are collinear


def turn_and_scale(model: Floats, targets: Floats) -> tuple[float, Floats, Floats]:
    """Return scale and rotation of the unweighted best fit about the means, and singular values.

    The second singular value of the sum of products is about 0 for collinear points, and the rotation is
    arbitrary. All singular values are 0 if products overflow.
    """
    a, b = model - model.mean(axis=0), targets - targets.mean(axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        products = b.T @ a
    if not np.isfinite(products).all():
        return 1.0, np.eye(3), np.zeros(3)
    left, sizes, right = np.linalg.svd(products)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right)) or 1.0])
    scale = float((sizes * signs).sum() / max((a**2).sum(), np.finfo(np.float64).tiny))
    return scale, (left * signs) @ right, sizes


def similarity(model: Floats, targets: Floats) -> tuple[float, Floats, Floats, float]:
    """Return scale, rotation, translation and rms misfit of the similarity between points.

    The misfit is infinite if the points do not determine the transformation.
    """
    scale, turn, sizes = turn_and_scale(model, targets)
    if sizes[1] < LINE * sizes[0] or not sizes[0] > 0:
        return 1.0, np.eye(3), np.zeros(3), np.inf
    middle, aim = model.mean(axis=0), targets.mean(axis=0)
    left = targets - aim - scale * (model - middle) @ turn.T
    return scale, turn, aim - scale * turn @ middle, float(np.sqrt(np.mean(left**2)))
