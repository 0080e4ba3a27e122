"""The adjusted block: arrays with their covariances."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.messages import Message
from photogram.network.block import Block
from photogram.results.observed import ObservedKind, observed_kinds
from photogram.results.scaled import Scaled
from photogram.statistics.limits import GlobalTest, global_test
from photogram.statistics.reliability import ROUNDING

if TYPE_CHECKING:
    from photogram import _photocore

__all__ = ["AdjustedBlock", "Iteration", "SumsOfSquares"]


@dataclass(frozen=True)
class Iteration:
    """One iteration.

    Attributes
    ----------
    number
        From 1.
    weighted_sum_of_squares
        After its corrections.
    largest_change
        No unknown changed by more than this multiple of its standard deviation (a priori unit weight).
    damping
        Levenberg-Marquardt damping of its step; 0 for a Gauss-Newton step.
    """

    number: int
    weighted_sum_of_squares: float
    largest_change: float
    damping: float


@dataclass(frozen=True)
class SumsOfSquares:
    """Weighted sums of squares.

    Attributes
    ----------
    camera
        Of the weighted positions and attitudes of the photos.
    ground
        Of the held components of control.
    plates
        Of the image coordinates.
    observations
        Of the observations beside images.
    """

    camera: float
    ground: float
    plates: float
    observations: float = 0.0

    @property
    def measured(self) -> float:
        """Of all but photos."""
        return self.ground + self.plates + self.observations

    @property
    def total(self) -> float:
        """All together."""
        return self.camera + self.ground + self.plates + self.observations


@dataclass(frozen=True, eq=False)
class AdjustedBlock(Scaled):
    """An adjusted block of P photos, n points and m image observations, in the order of the block.

    Positions are X, Y, Z or longitude (rad), latitude (rad), height; angles are radians, image coordinates
    millimetres. What was left out of the adjustment is NaN. Cofactors hold for a priori unit weight;
    covariances are cofactors times the variance of unit weight. Arrays cannot be written.

    Attributes
    ----------
    block
        What was adjusted: a copy, which later changes of the caller's lists do not reach.
    status
        `converged`, `not converged` or `diverged`.
    messages
        Remarks on the block that did not stop the adjustment.
    loss
        Name and scale of the robust loss of the image points; None for least squares.
    initial_weighted_sum_of_squares, iterations
        The history; with a loss, sums of losses.
    sums_of_squares, degrees_of_freedom
        Weighted sums by group, and the degrees of freedom of the chosen unit variance.
    unit_variance
        What the variance of unit weight is based on: `free`, `constrained` or `unity`.
    variance_of_unit_weight
        None without degrees of freedom; covariances are then scaled by 1.
    photo_corrections
        (k, P, 6) corrections of position and attitude in each of the k iterations; they lead from the initial
        to the adjusted values.
    photo_positions, photo_attitudes
        (P, 3) adjusted.
    photo_cofactors
        (P, 6, 6): position, then omega, phi, kappa.
    photo_redundancy
        (P, 6) redundancy numbers of positions and attitudes as observations; 0 unless weighted.
    point_positions
        (n, 3) adjusted.
    point_last_corrections
        (n, 3) corrections in the last iteration.
    point_cofactors
        (n, 3, 3).
    point_redundancy
        (n, 3) redundancy numbers of held components; 0 unless weighted.
    point_rays
        (n,) number of images; 0 for points left out.
    residuals
        (m, 2) observed minus computed, millimetres.
    redundancy
        (m, 2) redundancy numbers.
    standardized
        (m, 2) residual / (standard deviation x root of redundancy number), a priori unit weight (Baarda's w);
        NaN without redundancy.
    image_weights
        (m,) factor by which the loss has changed the weight of an image point; 1 without a loss.
    kinds
        Observations beside images: arrays for each kind, by its name.
    dropped
        Points left out, with the reason.
    ordering, photo_order, predictions
        The ordering of photos in force, (P,) the indices of the photos as they were eliminated, and the
        predicted multiply-adds of one factorisation in each ordering that was tried.
    operations, formations, seconds
        Predicted multiply-adds of each phase, the number of formations of the normal equations, and seconds
        spent in each phase.
    """

    block: Block
    status: str
    messages: list[Message]
    loss: tuple[str, float] | None
    initial_weighted_sum_of_squares: float
    iterations: list[Iteration]
    sums_of_squares: SumsOfSquares
    degrees_of_freedom: int
    unit_variance: str
    variance_of_unit_weight: float | None
    photo_corrections: Floats
    photo_positions: Floats
    photo_attitudes: Floats
    photo_cofactors: Floats
    photo_redundancy: Floats
    point_positions: Floats
    point_last_corrections: Floats
    point_cofactors: Floats
    point_redundancy: Floats
    point_rays: NDArray[np.int64]
    residuals: Floats
    redundancy: Floats
    standardized: Floats
    image_weights: Floats
    kinds: Mapping[str, ObservedKind]
    dropped: Mapping[str, str]
    ordering: str
    predictions: Mapping[str, float]
    photo_order: NDArray[np.int64]
    operations: Mapping[str, float]
    formations: int
    seconds: Mapping[str, float]

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    @classmethod
    def from_solution(
        cls,
        block: Block,
        solution: _photocore.BlockSolution,
        unit_variance: str,
        loss: tuple[str, float] | None,
        messages: list[Message],
    ) -> Self:
        """Take over what the core found: under the same names, but for what is put otherwise here."""
        found: dict[str, Any] = {
            "block": block.kept(),
            "messages": messages,
            "loss": loss,
            "initial_weighted_sum_of_squares": solution.initial_sum_of_squares,
            "iterations": [Iteration(*row) for row in solution.iterations],
            "sums_of_squares": SumsOfSquares(*solution.sums_of_squares),
            "unit_variance": unit_variance,
            "kinds": observed_kinds(block, solution),
            "dropped": {block.point_ids[point]: reason for point, reason in solution.dropped},
        }
        same = {each.name: getattr(solution, each.name) for each in fields(cls) if each.name not in found}
        return cls(**found, **same)

    @property
    def global_test(self) -> GlobalTest | None:
        """The test of all residuals together; None without degrees of freedom.

        It takes the observations on which the variance of unit weight is based: with `constrained` cameras
        all of them, else image coordinates, observations beside these and ground control.
        """
        sums = self.sums_of_squares
        tested = sums.total if self.unit_variance == "constrained" else sums.measured
        return global_test(tested, self.degrees_of_freedom)

    @property
    def photo_residuals(self) -> Floats:
        """(P, 6) observed minus adjusted position and attitude; 0 where fixed, NaN where free.

        Longitudes and attitudes differ by half a turn at the most.
        """
        residuals = self._photo_observed - np.hstack([self.photo_positions, self.photo_attitudes])
        turning = [0, 3, 4, 5] if self.block.geographic else [3, 4, 5]
        residuals[:, turning] = _least_turns(residuals[:, turning])
        return np.where(np.isfinite(self.photo_given_sd), residuals, np.nan)

    @property
    def photo_standardized(self) -> Floats:
        """(P, 6) `photo_residuals` / (sd x root of redundancy number); NaN unless weighted."""
        return _standardized(self.photo_residuals, self.photo_given_sd, self.photo_redundancy)

    @property
    def _photo_observed(self) -> Floats:
        block = self.block
        positions, attitudes = block.photo_positions_observed, block.photo_attitudes_observed
        return np.hstack(
            [
                block.photo_positions if positions is None else positions,
                block.photo_attitudes if attitudes is None else attitudes,
            ]
        )

    @property
    def photo_given_sd(self) -> Floats:
        """(P, 6) standard deviations of observed positions and attitudes: infinite free, zero fixed."""
        return np.hstack([self.block.photo_position_sd, self.block.photo_attitude_sd])

    @property
    def point_residuals(self) -> Floats:
        """(n, 3) observed minus adjusted held components; 0 where fixed, NaN where not held."""
        return np.where(np.isfinite(self.block.point_sd), -self.point_differences, np.nan)

    @property
    def point_standardized(self) -> Floats:
        """(n, 3) `point_residuals` / (sd x root of redundancy number); NaN unless weighted."""
        return _standardized(self.point_residuals, self.block.point_sd, self.point_redundancy)

    @property
    def point_kinds(self) -> NDArray[np.str_]:
        """(n,) `control` with a component held, `check` with components known but none held, else `pass`."""
        held = np.isfinite(self.block.point_sd).any(axis=1)
        known = np.isfinite(self.block.point_positions).any(axis=1)
        return np.where(held, "control", np.where(known, "check", "pass"))

    @property
    def used_points(self) -> NDArray[np.bool_]:
        """(n,) whether a point took part."""
        return self.point_rays > 0

    @property
    def used_images(self) -> NDArray[np.bool_]:
        """(m,) whether an image took part."""
        used: NDArray[np.bool_] = self.used_points[self.block.image_points]
        return used

    @property
    def point_differences(self) -> Floats:
        """(n, 3) adjusted minus supplied coordinates; NaN where none were supplied.

        Longitudes differ by half a turn at the most, on whichever side of the antimeridian they are counted.
        """
        differences = self.point_positions - self.block.point_positions
        if self.block.geographic:
            differences[:, 0] = _least_turns(differences[:, 0])
        return differences


def _least_turns(angles: Floats) -> Floats:
    """Take away whole turns."""
    return np.asarray(angles - math.tau * np.round(angles / math.tau))


def _standardized(residuals: Floats, sd: Floats, redundancy: Floats) -> Floats:
    """Return Baarda's w; NaN for what is no observation, and where rounding is all there is of redundancy."""
    tested = np.isfinite(sd) & (sd > 0) & (redundancy > ROUNDING)
    values = np.full(residuals.shape, np.nan)
    values[tested] = residuals[tested] / (sd[tested] * np.sqrt(redundancy[tested]))
    return values
