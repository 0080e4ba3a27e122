"""The frame of marks that are known by distances alone: a singular covariance made definite."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError

__all__ = ["with_datum"]

SINGULAR = 1e-9
"""Least part of the largest eigenvalue of a covariance that is not zero."""
HELD = 1e-2
"""Standard deviation of the frame in parts of the least of the figure."""


def with_datum(xy: Floats, covariance: Floats) -> tuple[Floats, int]:
    """Return a covariance of marks that is positive definite, and how many movements it holds.

    A figure from distances has no covariance of shifts and rotation, G: C G = 0. Its frame is that of its
    marks, and C + s^2 G G' with s small says this with weights. Films take shift and rotation by t and theta,
    images by the principal point and kappa: nothing that can be estimated depends on s, but for the principal
    point, to whose variance s^2/n is added.

    Parameters
    ----------
    xy
        (n, 2) places of the marks, mm.
    covariance
        (2n, 2n) theirs, x and y of a mark behind each other, mm^2.

    Raises
    ------
    InputError
        A covariance that is singular otherwise.
    """
    values, vectors = np.linalg.eigh(covariance)
    free = values < SINGULAR * values[-1]
    count = int(free.sum())
    if not count:
        return covariance, 0
    movements = _movements(xy)
    outside = vectors[:, free] - movements @ (movements.T @ vectors[:, free])
    if count > 3 or np.abs(outside).max() > np.sqrt(SINGULAR):
        raise InputError(
            "the covariance of its marks is singular, and not as that of distances is: by shifts and rotation"
        )
    own = vectors[:, free]
    return covariance + HELD**2 * values[~free].min() * (own @ own.T), count


def _movements(xy: Floats) -> Floats:
    """Return (2n, 3) an orthonormal basis of shifts and the rotation of n marks."""
    shift = np.tile(np.eye(2), (len(xy), 1))
    about = xy - xy.mean(axis=0)
    turn = np.column_stack([-about[:, 1], about[:, 0]]).reshape(-1, 1)
    return np.linalg.qr(np.hstack([shift, turn]))[0]
