"""What is known of the knots of splined lenses before an adjustment: standard deviations about zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.network.knots import KNOTTED

__all__ = ["WEAK", "with_knot_sd"]

WEAK = (1.0, 0.1)
"""Along the radius and across, in units of the stereographic image: 1 is 53 degrees off the axis."""


def with_knot_sd(
    cameras: Sequence[Camera], knot_sd: tuple[float, float] | None, regularise: str | None
) -> list[Camera]:
    """Return cameras whose free knots are observed as zero, radially and tangentially.

    Parameters
    ----------
    cameras
        The cameras.
    knot_sd
        Along the radius and across. None: `WEAK`, unless `regularise` says them.
    regularise
        Whose priors cameras have.

    Raises
    ------
    InputError
        Standard deviations of knots that there are not, or that are said twice; such that are not positive.
    """
    if knot_sd is not None:
        if not all(0 < each < np.inf for each in knot_sd):
            raise InputError(f"knot_sd is two positive numbers, radial and tangential, not {knot_sd}")
        if regularise is not None:
            raise InputError(f"knot_sd: {regularise} has standard deviations of knots of its own")
        if not any(each.model == KNOTTED for each in cameras):
            raise InputError(f"knot_sd: {cameras[0].model} has no knots; {KNOTTED} has")
    if regularise is not None:
        return list(cameras)
    own = WEAK if knot_sd is None else knot_sd
    return [each.replace(knot_sd=own) if each.knot_unknowns else each for each in cameras]
