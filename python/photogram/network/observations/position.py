"""Positions of photos from GNSS."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.observations.observation import AXES, Observation
from photogram.network.trajectories import Clock, Trajectory
from photogram.network.unknowns import Drift, LeverArm, Shift, Unknown

__all__ = ["Position", "epochs_of", "with_epochs"]


@dataclass(frozen=True, eq=False)
class Position(Observation):
    """The position of the GNSS antenna of a photo: C + A l + s + d dt.

    Parameters
    ----------
    photo
        Its name; None where it is of a trajectory.
    position
        (3,) observed X, Y, Z of the antenna; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations in the linear unit, or one for all: of X, Y, Z; or of east, north, up.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.
    lever_arm
        (3,) l, from the projection centre to the antenna in the axes of the photo (x right, y up, z back
        towards the viewer), in the linear unit; or one that is unknown.
    shift
        s; None without.
    drift
        d; None without. It counts from its epoch, or the mean time of the observations that it is given to.
    time
        Seconds.
    trajectory, clock
        What it is of in the place of a photo, at `time`, and the offset of the receiver's clock.

    Raises
    ------
    InputError
        Values that are not finite, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "position"
    PHOTOS = ("photo",)
    UNKNOWNS = (("lever_arm", LeverArm), ("shift", Shift), ("drift", Drift))
    VALUES = (("position", (3,)), ("lever_arm", (3,)), ("time", ()))
    COMPONENTS = AXES
    LOCAL = True

    photo: str | None
    position: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    lever_arm: ArrayLike | LeverArm = 0.0
    shift: Shift | None = None
    drift: Drift | None = None
    time: float = 0.0
    trajectory: Trajectory | None = None
    clock: Clock | None = None

    @classmethod
    def values_of(cls, observations: Sequence[Observation]) -> Floats:
        """Return what the core takes; times count from the epochs of drifts."""
        values = super().values_of(observations)
        epochs = epochs_of(observations)
        drifts = [each.unknowns[-1] for each in observations]
        values[:, -1] -= [0.0 if each is None else epochs[id(each)] for each in drifts]
        return values


def epochs_of(observations: Iterable[Observation]) -> dict[int, float]:
    """Return the epoch of each drift, by its identity: its own, or the mean time of its observations."""
    times: dict[int, list[float]] = {}
    given: dict[int, float] = {}
    for each in observations:
        if isinstance(each, Position) and each.drift is not None:
            times.setdefault(id(each.drift), []).append(each.time)
            if each.drift.epoch is not None:
                given[id(each.drift)] = each.drift.epoch
    return {key: float(np.mean(own)) for key, own in times.items()} | given


def with_epochs(observations: Sequence[Observation]) -> list[Observation]:
    """Return observations whose drifts count from where they do now, whichever of them are left out."""
    epochs = epochs_of(observations)
    dated: dict[int, Unknown] = {}
    for each in (one for own in observations for one in own.unknowns):
        if isinstance(each, Drift) and each.epoch is None and id(each) in epochs:
            dated[id(each)] = each.replace(epoch=epochs[id(each)])
    return [_exchanged(each, dated) for each in observations] if dated else list(observations)


def _exchanged(observation: Observation, dated: Mapping[int, Unknown]) -> Observation:
    """Return an observation of other common unknowns in place of some."""
    fields = zip(observation.UNKNOWNS, observation.unknowns if observation.UNKNOWNS else (), strict=True)
    changes: dict[str, Any] = {name: dated[id(own)] for (name, _), own in fields if id(own) in dated}
    return replace(observation, **changes) if changes else observation
