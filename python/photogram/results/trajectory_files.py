"""Trajectories in saved results: with their coefficients, which observations and adjusted unknowns share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.structure import Stand
from photogram.lazy_dataclasses import dataclass
from photogram.network.lens import Lens
from photogram.network.moving_photos import Lines, LineSensor, Shutter, Timed
from photogram.network.trajectories import (
    Angles,
    Basis,
    Coefficient,
    Polynomial,
    PositionAxes,
    Spline,
    Table,
    Trajectory,
)

__all__ = ["CLASSES", "STANDS", "KeptTrajectory"]


@dataclass(frozen=True, eq=False)
class KeptTrajectory(Stand):
    """What stands for a trajectory: what makes it, and the coefficients that it has made.

    A trajectory that is made again has coefficients of its own, and is given back those that others share.
    """

    name: str
    table: Table
    position: Basis | None
    rotation: Basis | None
    body: tuple[Floats, Floats] | None
    position_axes: PositionAxes
    angles: Angles
    coefficients: tuple[tuple[Coefficient, ...], tuple[Coefficient, ...]]

    @classmethod
    def of(cls, given: Any) -> KeptTrajectory:
        """Return what stands for a trajectory."""
        own = (given.name, given.table, given.position, given.rotation, given.body)
        return cls(*own, given.position_axes, given.angles, given.coefficients)

    def original(self) -> Trajectory:
        """Return the trajectory.

        Raises
        ------
        InputError
            Others than its coefficients.
        """
        own_parts = (self.table, self.position, self.rotation, self.body)
        made = Trajectory(self.name, *own_parts, self.position_axes, self.angles)
        own, kept = (
            [[each.title for each in part] for part in both]
            for both in (made.coefficients, self.coefficients)
        )
        if own != kept:
            raise InputError(f"the trajectory {self.name} has not the coefficients that stand with it")
        object.__setattr__(made, "coefficients", self.coefficients)
        return made


CLASSES = (KeptTrajectory, Lens, Lines, LineSensor, Polynomial, Shutter, Spline, Table, Timed)
"""Classes that a document of a block with trajectories may name."""
STANDS: dict[type, Callable[[Any], Stand]] = {Trajectory: KeptTrajectory.of}
"""What is written in the place of others."""
