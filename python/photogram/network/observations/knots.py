"""What is observed of the knots of lenses: regularisation, as priors about zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.network.cameras import Camera
from photogram.network.knots import Knot
from photogram.network.observations.observation import Observation
from photogram.network.observations.prior import Prior

__all__ = ["with_knots"]


def with_knots(observations: Sequence[Observation], cameras: Sequence[Camera]) -> tuple[Observation, ...]:
    """Return observations with those of the weighted knots of cameras: each is zero, radially and across.

    Those of knots of other cameras go.
    """
    own = [knot for camera in cameras for knot in camera.knot_unknowns]
    there = {id(each) for each in own}
    found = [each for each in observations if not _of_others(each, there)]
    observed = {id(each.unknown) for each in found if isinstance(each, Prior)}
    weighted = [each for each in own if each.covariance is not None and id(each) not in observed]
    return (
        *found,
        *(Prior(each, covariance=each.covariance, value=np.zeros(2)) for each in weighted),
    )


def _of_others(observation: Observation, there: set[int]) -> bool:
    return (
        isinstance(observation, Prior)
        and isinstance(observation.unknown, Knot)
        and id(observation.unknown) not in there
    )
