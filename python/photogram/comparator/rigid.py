"""The free adjustment: rotation and translation only (subroutine FIDFIT2)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.decomposition import rotation_matrix
from photogram.comparator.residuals import Residuals
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.readings import Integers

__all__ = ["RigidFit", "fit_rigid"]

LOST = 1.5
"""Half of rotation and two translations: what each axis loses."""


@dataclass(frozen=True, eq=False)
class RigidFit:
    """A rigid fit: grid = M(rotation) comparator + translation.

    Attributes
    ----------
    rotation_rad
        Of the plate against the comparator.
    translation_um
        (2,) grid coordinates of the comparator's zero, in the handedness of the comparator.
    residuals
        In both systems.
    """

    rotation_rad: float
    translation_um: Floats
    residuals: Residuals


def fit_rigid(
    points: Integers, xy_um: Floats, grid_um: Floats, *, lost: float = LOST, as_listed: bool = False
) -> RigidFit:
    """Fit measured coordinates onto grid coordinates of the same handedness by rotation and translation.

    The rotation is that of the least-squares similarity transformation, which is that of the rigid one as
    well.

    Parameters
    ----------
    points
        (n,) numbers, two at least.
    xy_um, grid_um
        (n, 2) measured (or corrected) and grid coordinates in micrometres.
    lost
        Unknowns for each axis, for the standard errors.
    as_listed
        Turn residuals back with the cosine and sine of the similarity transformation, without taking its
        scale out (a relative difference of 1e-5 or so).
    """
    middle, grid_middle = xy_um.mean(axis=0), grid_um.mean(axis=0)
    d, g = xy_um - middle, grid_um - grid_middle
    along = float((d * g).sum())
    across = float((d[:, 1] * g[:, 0] - d[:, 0] * g[:, 1]).sum())
    rotation = math.atan2(across, along)
    matrix = rotation_matrix(rotation)
    grid_residuals = d @ matrix.T - g
    size = math.hypot(along, across) / float((d * d).sum()) if as_listed else 1.0
    comparator = -size * grid_residuals @ matrix
    return RigidFit(
        rotation,
        np.asarray(grid_middle - matrix @ middle),
        Residuals(points, xy_um, comparator, grid_residuals, lost),
    )
