"""The result of the adjustment of a block: arrays with their covariances, and the ways to show them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats, Indices
from photogram.messages import Message
from photogram.network.block import Block
from photogram.results.cameras import AdjustedCamera, adjusted_cameras
from photogram.results.kinds import ObservedKind, observed_kinds
from photogram.results.network import AdjustedNetwork
from photogram.results.unknowns import AdjustedUnknown, adjusted_unknowns
from photogram.statistics.limits import GlobalTest, global_test

if TYPE_CHECKING:
    import pandas as pd

    from photogram import _photocore

__all__ = ["Result", "SumsOfSquares"]


@dataclass(frozen=True)
class SumsOfSquares:
    """Weighted sums of squares.

    Attributes
    ----------
    camera
        Of the weighted positions and attitudes of the photos, and of weighted parameters of cameras.
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


@dataclass(frozen=True, eq=False, kw_only=True)
class Result(AdjustedNetwork):
    """An adjusted block; the arrays that every network has are those of `AdjustedNetwork`, with k = 6.

    The unknowns of a photo are its position and omega, phi, kappa. Positions are X, Y, Z or longitude (rad),
    latitude (rad), height; angles are radians, image coordinates millimetres or the unit of the cameras.

    Attributes
    ----------
    block
        What was adjusted: a copy, which later changes of the caller's lists do not reach.
    sums_of_squares
        Weighted sums by group.
    unit_variance
        What degrees of freedom and variance of unit weight are based on: `free`, `constrained` or `unity`.
    photo_corrections
        (i, P, 6) corrections of position and attitude in each of the i iterations; they lead from the initial
        to the adjusted values.
    photo_positions, photo_attitudes
        (P, 3) adjusted.
    photo_order
        (P,) the indices of the photos as they were eliminated.
    point_last_corrections
        (n, 3) corrections in the last iteration.
    kinds
        Observations beside images: arrays for each kind, by its name.
    cameras
        The adjusted cameras of the block, in its order; none where it has principal distances.
    unknowns
        The adjusted unknowns that observations, and photos on frames, have in common, in the order of
        `block.unknowns`.
    dropped
        Points left out, with the reason.
    """

    block: Block
    sums_of_squares: SumsOfSquares
    unit_variance: str
    photo_corrections: Floats
    photo_positions: Floats
    photo_attitudes: Floats
    photo_order: Indices
    point_last_corrections: Floats
    kinds: Mapping[str, ObservedKind]
    cameras: tuple[AdjustedCamera, ...]
    unknowns: tuple[AdjustedUnknown, ...]
    dropped: Mapping[str, str]

    @classmethod
    def from_solution(
        cls,
        block: Block,
        solution: _photocore.BlockSolution,
        unit_variance: str,
        loss: tuple[str, float] | None,
        messages: list[Message],
    ) -> Self:
        """Take over what the core found."""
        variance = solution.variance_of_unit_weight
        scale = 1.0 if variance is None else variance
        return cls.taken_over(
            solution,
            block=block.kept(),
            messages=messages,
            loss=loss,
            sums_of_squares=SumsOfSquares(*solution.sums_of_squares),
            unit_variance=unit_variance,
            kinds=observed_kinds(block, solution),
            cameras=adjusted_cameras(block, solution, scale),
            unknowns=adjusted_unknowns(block, solution, scale),
            dropped={block.point_ids[point]: reason for point, reason in solution.dropped},
        )

    @property
    def image_points(self) -> Indices:
        """(m,) the point of each image."""
        return self.block.image_points

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
    def point_given_sd(self) -> Floats:
        """(n, 3) standard deviations of supplied coordinates: infinite not held, zero fixed."""
        return self.block.point_sd

    @property
    def point_residuals(self) -> Floats:
        """(n, 3) observed minus adjusted held components; 0 where fixed, NaN where not held."""
        return np.where(np.isfinite(self.block.point_sd), -self.point_differences, np.nan)

    @property
    def point_kinds(self) -> NDArray[np.str_]:
        """(n,) `control` with a component held, `check` with components known but none held, else `pass`."""
        held = np.isfinite(self.block.point_sd).any(axis=1)
        known = np.isfinite(self.block.point_positions).any(axis=1)
        return np.where(held, "control", np.where(known, "check", "pass"))

    @property
    def point_differences(self) -> Floats:
        """(n, 3) adjusted minus supplied coordinates; NaN where none were supplied.

        Longitudes differ by half a turn at the most, on whichever side of the antimeridian they are counted.
        """
        differences = self.point_positions - self.block.point_positions
        if self.block.geographic:
            differences[:, 0] = _least_turns(differences[:, 0])
        return differences

    def check_table(self) -> pd.DataFrame:
        """Return check points as a data frame: adjusted minus supplied coordinates, standard deviations."""
        return self._table("check")

    def camera_table(self) -> pd.DataFrame:
        """Return adjusted cameras as a data frame: a row for each parameter, with its unit."""
        return self._table("camera")

    def unknown_table(self) -> pd.DataFrame:
        """Return adjusted common unknowns as a data frame: a row for each component, with its unit."""
        return self._table("unknown")

    def observation_table(self) -> pd.DataFrame:
        """Return observations beside images as a data frame, a row for each component, with its unit."""
        return self._table("observation")


def _least_turns(angles: Floats) -> Floats:
    """Take away whole turns."""
    return np.asarray(angles - math.tau * np.round(angles / math.tau))


AdjustedBlock = Result
"""The name that its arrays had when they were a class of their own."""
