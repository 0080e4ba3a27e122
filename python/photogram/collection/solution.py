"""The adjusted collection: arrays with their covariances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats, Indices
from photogram.collection.collection import Collection
from photogram.messages import Message
from photogram.results.adjusted import Iteration
from photogram.results.scaled import Scaled

__all__ = ["CollectionSolution"]


@dataclass(frozen=True, eq=False)
class CollectionSolution(Scaled):
    """An adjusted collection of P photos, n points and m image points, in the order of the collection.

    What was left out of the adjustment is NaN. Cofactors hold for a priori unit weight and for the datum
    that the observations and weights give; where these give none, for that of the held parameters in
    `datum`. Covariances are cofactors times the variance of unit weight.

    Attributes
    ----------
    collection
        What was adjusted.
    status
        `converged`, `not converged` or `diverged`.
    messages
        Remarks that did not stop the adjustment.
    initial_weighted_sum_of_squares, iterations
        The history; with a loss, sums of losses.
    loss
        Name and scale of the robust loss; None for least squares.
    weighted_sum_of_squares, degrees_of_freedom, variance_of_unit_weight
        Of images and weighted unknowns, weights as the loss has modified them; the variance is None without
        degrees of freedom, and covariances are then scaled by 1.
    photo_parameters
        (P, 9) adjusted; see :class:`Collection`.
    photo_cofactors
        (P, 9, 9).
    photo_redundancy
        (P, 9) redundancy numbers of weighted parameters; 0 unless weighted.
    photo_images
        (P,) number of image points.
    point_positions
        (n, 3) adjusted.
    point_cofactors
        (n, 3, 3).
    point_redundancy
        (n, 3) redundancy numbers of weighted coordinates; 0 unless weighted.
    point_rays, point_rays_behind
        (n,) number of image points, and how many of them have the point behind the camera.
    residuals
        (m, 2) observed minus computed, pixels.
    redundancy
        (m, 2) redundancy numbers.
    standardized
        (m, 2) residual / (standard deviation x root of redundancy number), a priori unit weight (Baarda's w).
    image_weights
        (m,) factor by which the loss has changed the weight; 1 without a loss.
    datum
        Photos and parameters that were held to give the cofactors a datum.
    ordering, predictions, operations, formations, seconds
        See :class:`photogram.Result`.
    """

    collection: Collection
    status: str
    messages: list[Message]
    initial_weighted_sum_of_squares: float
    iterations: list[Iteration]
    loss: tuple[str, float] | None
    weighted_sum_of_squares: float
    degrees_of_freedom: int
    variance_of_unit_weight: float | None
    photo_parameters: Floats
    photo_cofactors: Floats
    photo_redundancy: Floats
    photo_images: Indices
    point_positions: Floats
    point_cofactors: Floats
    point_redundancy: Floats
    point_rays: Indices
    point_rays_behind: Indices
    residuals: Floats
    redundancy: Floats
    standardized: Floats
    image_weights: Floats
    datum: list[tuple[int, str]]
    ordering: str
    predictions: Mapping[str, float]
    operations: Mapping[str, float]
    formations: int
    seconds: Mapping[str, float]

    @property
    def cost(self) -> float:
        """Half the sum that was minimised, at the adjusted values."""
        last = self.iterations[-1].weighted_sum_of_squares if self.iterations else None
        return 0.5 * (self.initial_weighted_sum_of_squares if last is None else last)

    @property
    def used_points(self) -> NDArray[np.bool_]:
        """(n,) whether a point took part."""
        return self.point_rays > 0

    @property
    def used_images(self) -> NDArray[np.bool_]:
        """(m,) whether an image took part."""
        used: NDArray[np.bool_] = self.used_points[self.collection.image_points]
        return used

    def adjusted(self) -> Collection:
        """Return the collection at its adjusted values; points that were left out stay as they were."""
        positions = np.where(
            self.used_points[:, np.newaxis], self.point_positions, self.collection.point_positions
        )
        return self.collection.replace(photo_parameters=self.photo_parameters, point_positions=positions)
