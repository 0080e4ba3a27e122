"""Adjusted common unknowns of observations, in the order of the block."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import standard_deviations
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.unknowns import Unknown

if TYPE_CHECKING:
    from photogram import _photocore


# Types with components of `position` for values, and types whose values are the first of `position`.
_PLACED = {"lever arm", "shift", "drift", "instrument", "level", "sensor", "position coefficient", "clock"}
_PLACED |= {"rotation coefficient", "gyro bias", "readout", "bend", "knot"}
_NUMBERS = {"film placement", "film size", "film bend", "roll"}
_NUMBERS |= {"fiducial", "pattern", "scanner", "scanner curve"}
_ARRAYS = ("change", "position", "attitude", "cofactors", "covariance", "with_former", "redundancy")


@dataclass(frozen=True, eq=False)
class AdjustedUnknown:
    """An adjusted common unknown with k components. Arrays are read-only."""

    given: Unknown
    # (k,) names and units: the linear unit, the linear unit a second, radians, radians a
    # second, seconds, or nothing
    components: tuple[str, ...]
    units: tuple[str, ...]
    # (k,) adjusted minus given; of rotations the rotation vector r about the given axes, R = R0
    # Exp(r)
    change: Floats
    # (3,) adjusted: l, s, d, (m, k, 0) of an instrument, c of a sensor, a coefficient of a trajectory, a
    # gyroscope's bias, (d, 0, 0) of a clock, (T, 0, 0) of a readout time or a factor of line rates; of
    # levels, planes and lines a position on them
    position: Floats
    # (3, 3) adjusted: the axes of a boresight, sensor, line or plane (the third along it, or its normal)
    attitude: Floats
    # (k, k) for a priori unit weight, of rotations about the adjusted axes and a line's position along these;
    # zero for fixed ones, NaN without covariances
    cofactors: Floats
    covariance: Floats  # (k, k) cofactors times the variance of unit weight
    # (k, j) cofactors with the unknown before it if both are adjusted as one: the size of a film with its
    # placement; j is 0 for all others
    with_former: Floats
    redundancy: Floats  # (k,) redundancy numbers of weighted components as observations; 0 unless weighted
    observations: int  # Number of its observations, and of its images of photos on frames or trajectories

    def __post_init__(self) -> None:
        # There may be four times as many as photos: their fields are not searched in each.
        for name in _ARRAYS:
            getattr(self, name).flags.writeable = False

    @property
    def name(self) -> str:
        return self.given.name

    @property
    def kind(self) -> str:
        return self.given.KIND

    @property
    def sd(self) -> Floats:
        """(k,) standard deviations; 0 if fixed."""
        return np.asarray(standard_deviations(self.covariance[np.newaxis])[0])

    @property
    def values(self) -> Floats:
        """(k,) its components of `position`, or else `change`."""
        own = {"x": 0, "y": 1, "z": 2, "scale": 0, "constant": 1, "height": 2}
        own |= {"offset": 0, "time": 0, "factor": 0}
        if self.kind in _NUMBERS:
            return self.position[: len(self.components)]
        if self.kind not in _PLACED:
            return self.change
        found = [
            self.position[own[name]] if name in own else self.change[k]
            for k, name in enumerate(self.components)
        ]
        return np.array(found)

    @property
    def standardized(self) -> Floats:
        """(k,) given minus adjusted, over its standard deviation; NaN unless weighted."""
        sd = self.given.deviations
        tested = (sd > 0) & np.isfinite(sd) & (self.redundancy > 0)
        found = np.full(len(sd), np.nan)
        found[tested] = -self.change[tested] / (sd[tested] * np.sqrt(self.redundancy[tested]))
        return found


def adjusted_unknowns(
    block: Block, solution: _photocore.BlockSolution, scale: float
) -> tuple[AdjustedUnknown, ...]:
    """Return the adjusted unknowns of a block with scaled covariances."""
    found = []
    # Factors of line rates have the type of readout times, but are plain numbers.
    factors = {id(each.rate) for each in block.timed if each.rate is not None}
    for given, row in zip(block.unknowns, solution.adjusted_unknowns, strict=True):
        change, position, attitude, cofactors, with_former, redundancy, observations = row
        k = len(change)
        matrix = np.array(cofactors).reshape(k, k)
        found.append(
            AdjustedUnknown(
                given=given,
                components=("factor",) if id(given) in factors else given.components,
                units=("",) if id(given) in factors else given.units(block.linear_unit),
                change=np.array(change),
                position=np.array(position),
                attitude=np.array(attitude).reshape(3, 3),
                cofactors=matrix,
                covariance=matrix * scale,
                with_former=np.array(with_former).reshape(k, len(with_former) // k),
                redundancy=np.array(redundancy),
                observations=observations,
            )
        )
    return tuple(found)
