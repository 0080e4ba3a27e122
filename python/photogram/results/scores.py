"""Decrease of the weighted sum of squares by additional unknowns (Rao's score)."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram import _photocore
    from photogram.arguments.types import Floats, Indices

TAKEN_UP = 1e-9  # Smaller parts of the partials are rounding errors


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of unknowns that a network does not have."""

    partials: Floats  # (k, m, 2) B, in standard deviations of the images
    projected: Floats  # (k, m, 2) R B
    residuals: Floats  # (m, 2) v, in standard deviations; zero for unused images

    @classmethod
    def of(cls, factor: _photocore.BlockCovariances, partials: Floats, residuals: Floats) -> Scores:
        """Return the scores by the factor of the normal equations."""
        return cls(partials, factor.project_images(partials, threads=0, progress=None), residuals)

    @cached_property
    def vector(self) -> Floats:
        """(k,) c = B' v."""
        return np.asarray(self.partials.reshape(len(self.partials), -1) @ self.residuals.ravel())

    @cached_property
    def matrix(self) -> Floats:
        """(k, k) C = B' R B."""
        k = len(self.partials)
        matrix = self.partials.reshape(k, -1) @ self.projected.reshape(k, -1).T
        return np.asarray((matrix + matrix.T) / 2)

    @cached_property
    def sizes(self) -> Floats:
        """(k,) roots of the diagonal of B' B."""
        return np.asarray(np.sqrt(np.einsum("kmi,kmi->k", self.partials, self.partials)))

    @property
    def taken_up(self) -> bool:
        """Whether unknowns absorb some scores, or images do not depend on them."""
        if not (self.sizes > 0).all():
            return True
        scaled = self.matrix / np.outer(self.sizes, self.sizes)
        return not (np.linalg.eigvalsh(scaled) > TAKEN_UP).all()

    def estimate(self, groups: Indices) -> tuple[float, float]:
        """Return the first-order estimate of the first unknown, and its sd.

        It follows from the differences of (m,) groups of images in it, c_g - x C_g, which include individual
        deformations of each group. It is arbitrary if unknowns absorb it.
        """
        # R v = v: the absorbed part of B does not contribute to either sum.
        of_images = [(self.projected[0] * each).sum(axis=1) for each in (self.residuals, self.projected[0])]
        c, own = (np.bincount(groups, each) for each in of_images)
        total = float(own.sum())
        if not total > TAKEN_UP * self.sizes[0] ** 2:
            return 0.0, np.inf
        value = float(c.sum()) / total
        return value, float(np.sqrt(((c - value * own) ** 2).sum())) / total

    def fall(self, first: int = 0) -> float:
        """Return T = c' C^-1 c of scores from `first` on, without absorbed parts."""
        own = np.flatnonzero(self.sizes[first:] > 0) + first
        values, vectors = np.linalg.eigh(
            self.matrix[np.ix_(own, own)] / np.outer(self.sizes[own], self.sizes[own])
        )
        along = vectors.T @ (self.vector[own] / self.sizes[own])
        kept = values > TAKEN_UP
        return float((along[kept] ** 2 / values[kept]).sum())


def score(factor: _photocore.BlockCovariances, partials: Floats, residuals: Floats) -> float | None:
    """Return T = c' C^-1 c; None if absorbed; see :meth:`Scores.of`."""
    found = Scores.of(factor, partials, residuals)
    return None if found.taken_up else quadratic(found.matrix, found.vector)


def quadratic(matrix: Floats, vector: Floats) -> float:
    """Return x' M^-1 x after scaling M to unit diagonal."""
    scale = np.sqrt(np.diag(matrix))
    scaled = vector / scale
    return float(scaled @ np.linalg.solve(matrix / np.outer(scale, scale), scaled))
