"""By how much the weighted sum of squares would fall with further unknowns (Rao's score; no adjustment)."""

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
    residuals: Floats  # (m, 2) v, in standard deviations; zero if an image takes no part

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
        """Whether the unknowns of the network take some of these up, or no image has them."""
        if not (self.sizes > 0).all():
            return True
        scaled = self.matrix / np.outer(self.sizes, self.sizes)
        return not (np.linalg.eigvalsh(scaled) > TAKEN_UP).all()

    def estimate(self, groups: Indices) -> tuple[float, float]:
        """Return what the first would be alone, to first order, and its standard deviation.

        That is from how (m,) groups of images differ in it, c_g - x C_g: whatever bends each of them its own
        way is in it. Where unknowns take it up it may be anything.
        """
        # R v = v: what unknowns take up of B has no part in either sum.
        of_images = [(self.projected[0] * each).sum(axis=1) for each in (self.residuals, self.projected[0])]
        c, own = (np.bincount(groups, each) for each in of_images)
        total = float(own.sum())
        if not total > TAKEN_UP * self.sizes[0] ** 2:
            return 0.0, np.inf
        value = float(c.sum()) / total
        return value, float(np.sqrt(((c - value * own) ** 2).sum())) / total

    def fall(self, first: int = 0) -> float:
        """Return T = c' C^-1 c of those from a place on, but for what the network takes up of them."""
        own = np.flatnonzero(self.sizes[first:] > 0) + first
        values, vectors = np.linalg.eigh(
            self.matrix[np.ix_(own, own)] / np.outer(self.sizes[own], self.sizes[own])
        )
        along = vectors.T @ (self.vector[own] / self.sizes[own])
        kept = values > TAKEN_UP
        return float((along[kept] ** 2 / values[kept]).sum())


def score(factor: _photocore.BlockCovariances, partials: Floats, residuals: Floats) -> float | None:
    """Return T = c' C^-1 c; None if the unknowns take the partials up; see :meth:`Scores.of`."""
    found = Scores.of(factor, partials, residuals)
    return None if found.taken_up else quadratic(found.matrix, found.vector)


def quadratic(matrix: Floats, vector: Floats) -> float:
    """Return x' M^-1 x, M scaled to unit diagonal before."""
    scale = np.sqrt(np.diag(matrix))
    scaled = vector / scale
    return float(scaled @ np.linalg.solve(matrix / np.outer(scale, scale), scaled))
