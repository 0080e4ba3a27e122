"""Observations that a robust loss removes in effect, and points that lose their support.

Observations with a weight factor below :data:`REMOVED` count as removed. The tests are those of a
least-squares adjustment of the others, which starts at the robust solution: the residuals of the latter have
no exact distribution.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.lazy_dataclasses import dataclass
from photogram.results.network_trial import CONTROL, IMAGE, OBSERVATION, NamedSuspects, NetworkTrial
from photogram.statistics.findings import Removed
from photogram.statistics.snooping.suspects import Out
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.results.network import AdjustedNetwork

REMOVED = 0.1  # Weight factor below which an observation counts as removed
SUPPORT = 2  # Smallest number of images of a point that are not removed
NAMED = 100  # Largest number of removed observations in documents


@dataclass(frozen=True, eq=False)
class Downweighted:
    """Observations and points that a robust loss excludes from the tests."""

    out: Out
    removed: Removed
    unsupported: list[Phrase]  # names of points with too few images


def downweighted(result: AdjustedNetwork, trial: NetworkTrial) -> Downweighted:
    """Return the observations that the loss of an adjustment removes in effect."""
    suspects = trial.suspects
    weights = _weights(result, suspects)
    removed = weights < REMOVED
    points, images = suspects.points, (suspects.kinds == IMAGE) & np.isfinite(weights)
    count = len(result.point_rays)
    rays, left = (np.bincount(points[own], minlength=count) for own in (images, images & ~removed))
    alone = np.flatnonzero((left < SUPPORT) & (rays > left))
    rows = np.repeat(removed | np.isin(points, alone), np.diff(suspects.row_starts))
    names = [suspects.name(int(group)) for group in np.flatnonzero(removed)[:NAMED]]
    control = {int(point) for point in points[suspects.kinds == CONTROL]}
    return Downweighted(
        Out(rows, set(alone.tolist())),
        Removed(
            [{"name": str(name), "subject": name} for name in names],
            suspects.counts(rows, np.isfinite(weights)),
            int(removed.sum()),
        ),
        [
            Phrase("named.control" if point in control else "named.object_point", {"point": str(name)})
            for point, name in zip(alone.tolist(), result._terms().points[alone].tolist(), strict=True)
        ],
    )


def _weights(result: AdjustedNetwork, suspects: NamedSuspects) -> Floats:
    """Return (G,) weight factors of groups; NaN if not used."""
    weights, terms = np.ones(len(suspects)), result._terms()
    images, others = suspects.kinds == IMAGE, suspects.kinds == OBSERVATION
    own = suspects.subjects[images]
    weights[images] = np.where(result.used_images[own], result.image_weights[own], np.nan)
    if others.any():
        factors = np.ones(len(terms.observation_rows))
        for kind in terms.kinds:
            factors[kind.rows] = kind.weights
        weights[others] = factors[terms.observation_rows[suspects.subjects[others]]]
    return weights
