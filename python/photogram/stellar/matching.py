"""Which catalogue star a measured image shows, from an approximate attitude and camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram.neighbours import mutually_nearest

__all__ = ["match", "mutually_nearest"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_SEEDS, _PAIRS = 25, 400
"""Brightest images that make hypotheses, and hypotheses tried."""
_PLAIN = 0.7
"""Share of bright images that a hypothesis has to explain to be taken at once."""


def match(measured: Floats, predicted: Floats, *, radius: float, tolerance: float) -> Indices:
    """Match measured star images to predicted ones.

    Pairs of bright images vote for a similarity between the two sets; the best one is refined by cubic
    polynomials.

    Parameters
    ----------
    measured
        (m, 2) images, the brightest first.
    predicted
        (n, 2) images of catalogue stars under the approximate attitude, the brightest first.
    radius
        Largest distance between an image and its prediction.
    tolerance
        Largest distance that is left after them.

    Returns
    -------
    (m,) index of the predicted image; -1 where there is none.
    """
    none = np.full(len(measured), -1, np.int64)
    if len(measured) < 3 or len(predicted) < 3:
        return none
    best, most = None, 2
    seeds = measured[: 3 * _SEEDS]
    for transform in _hypotheses(measured[:_SEEDS], predicted[: 2 * _SEEDS], radius, tolerance):
        found = mutually_nearest(_apply(transform, seeds), predicted, 3 * tolerance)
        count = int((found >= 0).sum())
        if count > most:
            best, most = transform, count
        if most > _PLAIN * len(seeds):
            break
    if best is None:
        return none
    moved = _apply(best, measured)
    for degree in (1, 1, 2, 3, 3, 3):
        found = mutually_nearest(moved, predicted, 2 * tolerance)
        chosen = found >= 0
        if chosen.sum() < 3:
            return none
        # Three matches and more for each coefficient.
        degree = min(degree, 3 if chosen.sum() > 30 else 2 if chosen.sum() > 18 else 1)
        moved = _fitted(measured, chosen, predicted[found[chosen]], degree)
    return mutually_nearest(moved, predicted, tolerance)


def _hypotheses(measured: Floats, predicted: Floats, radius: float, tolerance: float) -> list[Floats]:
    """Return similarities (3, 2) from pairs of candidates whose separations agree, the widest pairs first."""
    distance = np.linalg.norm(measured[:, None] - predicted[None], axis=2)
    i, k = np.nonzero(distance <= radius)
    a, b = np.triu_indices(len(i), 1)
    keep = (i[a] != i[b]) & (k[a] != k[b])
    a, b = a[keep], b[keep]
    first = (measured[i[b]] - measured[i[a]]) @ np.array([1, 1j])
    second = (predicted[k[b]] - predicted[k[a]]) @ np.array([1, 1j])
    agree = (np.abs(np.abs(first) - np.abs(second)) < 3 * tolerance + 0.01 * np.abs(first)) & (
        np.abs(first) > radius
    )
    # Small turns first: the approximate attitude is nearly right.
    turn = np.abs(np.angle(second[agree] / first[agree]))
    order = np.argsort(np.round(turn, 2) * 10 - np.abs(first[agree]) / np.abs(first).max(initial=1.0))[
        :_PAIRS
    ]
    made = []
    for p, z, w in zip(a[agree][order], first[agree][order], second[agree][order], strict=True):
        factor = w / z
        shift = predicted[k[p]] @ np.array([1, 1j]) - factor * (measured[i[p]] @ np.array([1, 1j]))
        made.append(
            np.array([[factor.real, factor.imag], [-factor.imag, factor.real], [shift.real, shift.imag]])
        )
    return made


def _apply(transform: Floats, points: Floats) -> Floats:
    return np.asarray(points @ transform[:2] + transform[2], float)


def _fitted(measured: Floats, chosen: NDArray[np.bool_], predicted: Floats, degree: int) -> Floats:
    """Move all images by the polynomials that fit the matched ones; tilt is quadratic, distortion cubic."""
    x, y = (measured / np.abs(measured).max(initial=1.0)).T
    powers = [(i, k - i) for k in range(degree + 1) for i in range(k + 1)]
    design = np.column_stack([x**i * y**j for i, j in powers])
    return np.asarray(design @ np.linalg.lstsq(design[chosen], predicted, rcond=None)[0], float)
