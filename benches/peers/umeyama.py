"""The similarity of full control in closed form (S. Umeyama, IEEE PAMI 13 (4), 1991), as usually written."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

__all__ = ["umeyama"]


def umeyama(control: Floats, model: Floats) -> tuple[float, Floats, Floats]:
    """Return s, A (3, 3), B (3,) with least sum of |s A X + B - x|^2 for (n, 3) control X and model x."""
    control_mean, model_mean = control.mean(axis=0), model.mean(axis=0)
    centred = control - control_mean
    covariance = (model - model_mean).T @ centred / len(control)
    u, values, vt = np.linalg.svd(covariance)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    rotation = u * sign @ vt
    scale = float(values @ sign / np.square(centred).sum(axis=1).mean())
    return scale, rotation, model_mean - scale * rotation @ control_mean
