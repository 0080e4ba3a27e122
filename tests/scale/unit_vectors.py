"""Cofactors by solving the normal equations for unit vectors: independent of the engine.

The normal equations of a block are formed with NumPy from complex-step partials of the collinearity
equations, the points are reduced out, and what is left is factored by SuperLU. Nothing of photogram takes
part but the adjusted values and the order of the photos, which only spares fill.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from photogram import Result

Floats = NDArray[np.float64]
Values = NDArray[np.float64] | NDArray[np.complex128]
Indices = NDArray[np.int64]

_STEP = 1e-30


def project(
    points: Values, positions: Values, attitudes: Values, principal_distances: NDArray[np.float64]
) -> Values:
    """Return the image coordinates of points (m, 3) in photos ground-to-photo; rectangular space."""
    omega, phi, kappa = attitudes.T
    x, y, z = (points - positions).T
    y, z = np.cos(omega) * y + np.sin(omega) * z, np.cos(omega) * z - np.sin(omega) * y
    x, z = np.cos(phi) * x - np.sin(phi) * z, np.sin(phi) * x + np.cos(phi) * z
    x, y = np.cos(kappa) * x + np.sin(kappa) * y, np.cos(kappa) * y - np.sin(kappa) * x
    xy: Values = (principal_distances * np.stack([x, y]) / z).T
    return xy


class UnitVectors:
    """The normal equations of an adjusted block in rectangular space: free photos, free or weighted points.

    Every point must have images, and no photo more than one of the same point. Images are taken point by
    point.
    """

    def __init__(self, result: Result) -> None:
        block = result.block
        self.photos = len(block.photo_ids)
        images = np.argsort(block.image_points, kind="stable")
        self._image = np.argsort(images)
        self._photo_of, self._point_of = block.image_photos[images], block.image_points[images]
        self._start = np.searchsorted(self._point_of, np.arange(len(block.point_ids) + 1))
        self._place = np.argsort(result.photo_order)
        by_photo, by_point = _partials(result, images)
        sd = block.image_sd[images][:, :, np.newaxis]
        self._by_photo, self._by_point = by_photo / sd, by_point / sd

        own = np.einsum("mri,mrj->mij", self._by_point, self._by_point)
        normal = np.add.reduceat(own, self._start[:-1])
        normal[:, range(3), range(3)] += block.point_sd**-2.0
        self._point_inverse = np.linalg.inv(normal)
        self._coupling = np.einsum("mri,mrj->mij", self._by_point, self._by_photo)
        reduced = self._reduced()
        self._scale = 1.0 / np.sqrt(reduced.diagonal())
        scaling = diags_array(self._scale)
        self._factor = splu(
            csc_array(scaling @ reduced @ scaling),
            permc_spec="NATURAL",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def _reduced(self) -> bsr_array:
        """Return the normal equations of the photos with the points reduced out, in order of elimination."""
        place = self._place[self._photo_of]
        own = np.einsum("mri,mrj->mij", self._by_photo, self._by_photo)
        total = _block_matrix(place, place, own, self.photos)
        rays = np.diff(self._start)
        for k in np.unique(rays):
            points = np.flatnonzero(rays == k)
            images = self._start[points][:, np.newaxis] + np.arange(k)
            coupling = self._coupling[images]
            moved = np.einsum("nij,nbjd->nbid", self._point_inverse[points], coupling)
            lost = -np.einsum("naic,nbid->nabcd", coupling, moved)
            first = np.broadcast_to(place[images][:, :, np.newaxis], lost.shape[:3])
            second = np.broadcast_to(place[images][:, np.newaxis, :], lost.shape[:3])
            blocks = lost.reshape(-1, 6, 6)
            total = total + _block_matrix(first.ravel(), second.ravel(), blocks, self.photos)
        return total

    def _solve(self, right: Floats) -> Floats:
        """Solve for right-hand sides (P, 6, c) of the photos."""
        moved = np.empty_like(right)
        moved[self._place] = right
        found = self._factor.solve(moved.reshape(6 * self.photos, -1) * self._scale[:, np.newaxis])
        found *= self._scale[:, np.newaxis]
        solution: Floats = found.reshape(right.shape)[self._place]
        return solution

    def around(self, images: Indices) -> list[tuple[Floats, Floats, Floats]]:
        """Return for images the cofactors of their photo (6, 6), their point (3, 3) and themselves (2, 2).

        The latter are those of the adjusted image coordinates, in units of their standard deviations.
        """
        rows = self._image[images]
        right = np.zeros((self.photos, 6, len(rows), 9))
        for number, row in enumerate(rows):
            of_point, moved = self._images_of_point(row)
            right[self._photo_of[row], :, number, :6] = np.eye(6)
            right[self._photo_of[of_point], :, number, 6:] = -moved
        columns = self._solve(right.reshape(self.photos, 6, -1)).reshape(right.shape)
        return [self._around(row, columns[:, :, number]) for number, row in enumerate(rows)]

    def _images_of_point(self, row: int) -> tuple[Indices, Floats]:
        """Return the images (k) of the point of an image, and N_lp N_pp^-1 of their photos (k, 6, 3)."""
        point = self._point_of[row]
        images = np.arange(self._start[point], self._start[point + 1])
        return images, np.einsum("kjd,ij->kdi", self._coupling[images], self._point_inverse[point])

    def _around(self, row: int, columns: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the cofactors around an image from the columns (P, 6, 9) of its photo and its point."""
        images, moved = self._images_of_point(row)
        photo = self._photo_of[row]
        of_photo, cross = columns[photo, :, :6], columns[photo, :, 6:]
        of_point = self._point_inverse[self._point_of[row]] - np.einsum(
            "kdi,kdj->ij", moved, columns[self._photo_of[images], :, 6:]
        )
        joint = np.block([[of_photo, cross], [cross.T, of_point]])
        partials = np.hstack([self._by_photo[row], self._by_point[row]])
        return of_photo, of_point, partials @ joint @ partials.T


def _partials(result: Result, images: Indices) -> tuple[Floats, Floats]:
    """Return partials by photos (m, 2, 6) and points (m, 2, 3), by complex steps."""
    block = result.block
    photos, points = block.image_photos[images], block.image_points[images]
    photo = np.hstack([result.photo_positions, result.photo_attitudes])[photos]
    values = np.hstack([photo, result.point_positions[points]]).astype(complex)
    partials = np.empty((len(images), 2, 9))
    for k in range(9):
        values[:, k] += 1j * _STEP
        xy = project(values[:, 6:], values[:, :3], values[:, 3:6], block.principal_distances[photos])
        partials[:, :, k] = xy.imag / _STEP
        values[:, k] = values[:, k].real
    return partials[:, :, :6], partials[:, :, 6:]


def _block_matrix(rows: Indices, columns: Indices, blocks: Floats, count: int) -> bsr_array:
    """Return a matrix of count x count blocks; those of the same place are added."""
    keys = rows * count + columns
    order = np.argsort(keys, kind="stable")
    places, starts = np.unique(keys[order], return_index=True)
    sums = np.add.reduceat(blocks[order], starts)
    pointers = np.searchsorted(places // count, np.arange(count + 1))
    return bsr_array((sums, places % count, pointers), shape=(6 * count, 6 * count))
