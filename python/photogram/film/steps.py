"""One step against two: standard deviations where films are inside the adjustment, or fitted before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.errors import InputError

if TYPE_CHECKING:
    from photogram.results.result import Result

__all__ = ["compare_steps"]


def compare_steps(chosen: Result, other: Result) -> str:
    """Say by how much standard deviations of points of a result differ from those of another.

    Both are of one project, `interior = "inside"` and `"before"`. Standard deviations are a priori: those of
    different variances of unit weight could not be compared.

    Parameters
    ----------
    chosen, other
        The results.

    Raises
    ------
    InputError
        Results without covariances, or of different points.
    """
    if list(chosen.block.point_ids) != list(other.block.point_ids):
        raise InputError("the results are of different points")
    one, two = (np.diagonal(each.point_cofactors, axis1=1, axis2=2) for each in (chosen, other))
    used = (one > 0).all(axis=1) & (two > 0).all(axis=1)
    if not used.any():
        raise InputError("the results have no covariances of points")
    parts = 100.0 * (np.median(np.sqrt(one[used] / two[used]), axis=0) - 1.0)
    axes = ", ".join(f"{part:+.1f} % in {axis}" for axis, part in zip("XYZ", parts.tolist(), strict=True))
    return f"standard deviations of points differ by {axes} from those of the other result (median)"
