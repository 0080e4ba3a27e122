"""The result of the adjustment of a collection: arrays with their covariances, and the ways to show them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.collection.collection import Collection
from photogram.collection.core import CollectionOptions
from photogram.collection.suspects import collection_trial
from photogram.results.network import AdjustedNetwork
from photogram.results.reliability import Reliability, reliability_of

if TYPE_CHECKING:
    from photogram import _photocore

__all__ = ["AdjustedCollection"]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class AdjustedCollection(AdjustedNetwork):
    """An adjusted collection; the arrays that every network has are those of `AdjustedNetwork`.

    The k unknowns of a photo are its parameters in the collection. Cofactors hold for the datum that the
    observations and weights give; where these give none, for that of the held parameters in `datum`.

    Attributes
    ----------
    collection
        What was adjusted.
    weighted_sum_of_squares
        Of images and weighted unknowns, weights as the loss has modified them.
    photo_parameters
        (P, k) adjusted; see :class:`Collection`.
    photo_images
        (P,) number of image points.
    point_rays_behind
        (n,) how many image points have the point behind the camera.
    datum
        Photos and parameters that were held to give the cofactors a datum.
    options, state
        How the core adjusted the collection, and where that ended.
    """

    collection: Collection
    weighted_sum_of_squares: float
    photo_parameters: Floats
    photo_images: Indices
    point_rays_behind: Indices
    datum: list[tuple[int, str]]
    options: CollectionOptions
    state: _photocore.BlockState

    KNOWN: ClassVar[bool] = False

    @property
    def _what(self) -> str:
        return "collection"

    @property
    def _image_unit(self) -> str:
        return "px"

    @property
    def cost(self) -> float:
        """Half the sum that was minimised, at the adjusted values."""
        last = self.iterations[-1].weighted_sum_of_squares if self.iterations else None
        return 0.5 * (self.initial_weighted_sum_of_squares if last is None else last)

    @property
    def image_points(self) -> Indices:
        """(m,) the point of each image."""
        return self.collection.image_points

    @property
    def image_given_sd(self) -> Floats:
        """(m, 2) standard deviations a priori of the image coordinates."""
        return self.collection.image_sd

    @property
    def photo_given_sd(self) -> Floats:
        """(P, k) standard deviations of given parameters as observations: infinite free, zero fixed."""
        return self.collection.photo_sd

    @property
    def photo_residuals(self) -> Floats:
        """(P, k) given minus adjusted parameters; 0 where fixed, NaN where free."""
        residuals = self.collection.photo_parameters - self.photo_parameters
        return np.where(np.isfinite(self.photo_given_sd), residuals, np.nan)

    @property
    def point_given_sd(self) -> Floats:
        """(n, 3) standard deviations of given coordinates as observations: infinite free, zero fixed."""
        return self.collection.point_sd

    @property
    def point_residuals(self) -> Floats:
        """(n, 3) given minus adjusted coordinates; 0 where fixed, NaN where free."""
        residuals = self.collection.point_positions - self.point_positions
        return np.where(np.isfinite(self.point_given_sd), residuals, np.nan)

    def reliability(
        self, *, level: float = 0.001, power: float = 0.80, unit_weight: str = "known"
    ) -> Reliability:
        """Return which gross errors of every observation are found, and what others do (docs/blunders.md).

        It takes a factorisation and a selected inverse at the adjusted values. A collection has no
        covariances on demand: influences on chosen unknowns cannot be asked for.

        Parameters
        ----------
        level, power
            Of the test of an observation: alpha0, beta0.
        unit_weight
            `known`, or `unknown`: estimated by the adjustment, which makes errors harder to find.

        Raises
        ------
        InputError
            Options that cannot be.
        KeyboardInterrupt
            Ctrl-C.
        """
        options = replace(self.options, covariance=True, loss=None)
        trial = collection_trial(self.collection, options, self.state)
        return reliability_of(trial, None, level=level, power=power, unit_weight=unit_weight)

    def adjusted(self) -> Collection:
        """Return the collection at its adjusted values; points that were left out stay as they were."""
        positions = np.where(
            self.used_points[:, np.newaxis], self.point_positions, self.collection.point_positions
        )
        return self.collection.replace(photo_parameters=self.photo_parameters, point_positions=positions)


CollectionSolution = AdjustedCollection
"""The name that its arrays had when they were a class of their own."""
