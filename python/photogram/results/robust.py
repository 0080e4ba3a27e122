"""Observations that a robust loss removes in effect, and points that lose their support.

Observations with a weight factor below :data:`REMOVED` count as removed. The tests are those of a
least-squares adjustment of the others, which starts at the robust solution: the residuals of the latter have
no exact distribution.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.lazy_dataclasses import dataclass
from photogram.results.network_trial import CONTROL, IMAGE, OBSERVATION, NamedSuspects, NetworkTrial, Out
from photogram.statistics.findings import Removed
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.arguments.types import Bools, Floats
    from photogram.results.axes import Terms

REMOVED = 0.1  # Weight factor below which an observation counts as removed
SUPPORT = 2  # Smallest number of images of a point that are not removed
NAMED = 100  # Largest number of removed observations in documents


@dataclass(frozen=True, eq=False)
class Downweighted:
    """Observations and points that a robust loss excludes from the tests."""

    out: Out
    removed: Removed
    unsupported: list[Phrase]  # names of points with too few images


def downweighted(trial: NetworkTrial, terms: Terms, image_weights: Floats, used: Bools) -> Downweighted:
    """Return the observations that the loss of an adjustment removes in effect.

    `image_weights` and `used` are the (m,) weight factors of the images, and whether they were used.
    """
    suspects = trial.suspects
    weights = _weights(suspects, terms, np.where(used, image_weights, np.nan))
    removed = weights < REMOVED
    points, images = suspects.points, (suspects.kinds == IMAGE) & np.isfinite(weights)
    count = len(terms.points)
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
            for point, name in zip(alone.tolist(), terms.points[alone].tolist(), strict=True)
        ],
    )


def _weights(suspects: NamedSuspects, terms: Terms, image_weights: Floats) -> Floats:
    """Return (G,) weight factors of groups; NaN if not used."""
    weights = np.ones(len(suspects))
    images, others = suspects.kinds == IMAGE, suspects.kinds == OBSERVATION
    weights[images] = image_weights[suspects.subjects[images]]
    if others.any():
        factors = np.ones(len(terms.observation_rows))
        for kind in terms.kinds:
            factors[kind.rows] = kind.weights
        weights[others] = factors[terms.observation_rows[suspects.subjects[others]]]
    return weights
