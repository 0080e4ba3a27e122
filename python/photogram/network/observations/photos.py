"""Observations of photos: GNSS positions and velocities, inertial attitudes, ranges, relative poses."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import by_key
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.columns import Observations
from photogram.network.observations.observation import AXES, ROTATIONS, Observation, with_unknowns
from photogram.network.trajectories import Clock, GyroBias, Trajectory
from photogram.network.unknowns import Boresight, Drift, Instrument, LeverArm, Shift, Unknown


@dataclass(frozen=True, eq=False)
class Position(Observation):
    """Observed position of the GNSS antenna of a photo: C + A l + s + d dt.

    Parameters
    ----------
    photo
        Name of the photo; None if a trajectory is observed.
    position
        (3,) observed X, Y, Z of the antenna; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations in the linear unit, or one for all; along X, Y, Z or east, north, up.
    covariance
        (3, 3) covariance matrix of the position, instead of `sd`.
    lever_arm
        (3,) l, from the projection centre to the antenna in the axes of the photo (x right, y up, z back
        towards the viewer), in the linear unit; or an unknown lever arm.
    shift
        Unknown shift s, optional.
    drift
        Unknown drift d, optional. It refers to its epoch, or to the mean time of the observations that share
        it.
    time
        Time in seconds.
    trajectory, clock
        Trajectory observed at `time` instead of a photo, and clock of the receiver with unknown offset.

    Raises
    ------
    InputError
        If a value is not finite, or weights are invalid: exactly one of `sd` and `covariance` is required.
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
    def core_values(cls, observed: Floats, unknowns: Sequence[tuple[Unknown | None, ...]]) -> Floats:
        """Return the values for the core; times are relative to the epochs of drifts."""
        if not any(own[-1] for own in set(unknowns)):
            return observed
        epochs = _epochs(zip((own[-1] for own in unknowns), observed[:, -1].tolist(), strict=True))
        values = observed.copy()
        values[:, -1] -= [epochs.get(own[-1], 0.0) for own in unknowns]
        return values


def _epochs(drifts: Iterable[tuple[Unknown | None, float]]) -> dict[Unknown | None, float]:
    """Return the epoch of each drift: given, or the mean of its observation times."""
    times = by_key((drift, time) for drift, time in drifts if isinstance(drift, Drift))
    return {
        drift: float(np.mean(own)) if drift.epoch is None else drift.epoch for drift, own in times.items()
    }


def with_epochs(observations: Observations[Observation]) -> Sequence[Observation]:
    """Fix the present epochs of all drifts, so that removals do not change them."""
    epochs = _epochs((each.drift, each.time) for each in observations.of_type(Position))
    dated: dict[int, Unknown] = {
        id(drift): drift.replace(epoch=epoch)
        for drift, epoch in epochs.items()
        if drift is not None and getattr(drift, "epoch") is None  # noqa: B009
    }
    return [with_unknowns(each, dated) for each in observations] if dated else observations


@dataclass(frozen=True, eq=False)
class Attitude(Observation):
    """Observed attitude of the body that carries a camera, e.g. an inertial unit: A B.

    Parameters
    ----------
    photo
        Name of the photo; None if a trajectory is observed.
    attitude
        (3, 3) observed rotation, body to object. Its columns are the axes of the body in X, Y, Z, or in east,
        north, up at the photo if the object space is geographic.
    sd
        (3,) standard deviations of rotations about the axes of the body in radians, or one for all.
    covariance
        (3, 3) covariance matrix of the rotations in square radians, instead of `sd`.
    boresight
        (3, 3) B, body to the axes of the photo (x right, y up, z back towards the viewer), or an unknown
        boresight. None if the observed attitude is the attitude of the photo.
    trajectory, time, clock
        Trajectory observed at a time in seconds instead of a photo, and clock with unknown offset.

    Raises
    ------
    InputError
        If a matrix is not a rotation, or weights are invalid: exactly one of `sd` and `covariance` is
        required.
    """

    KIND = "attitude"
    PHOTOS = ("photo",)
    UNKNOWNS = (("boresight", Boresight),)
    VALUES = (("attitude", (3, 3)), ("boresight", (3, 3)))
    COMPONENTS = ROTATIONS

    photo: str | None
    attitude: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    boresight: ArrayLike | Boresight | None = None
    trajectory: Trajectory | None = None
    time: float = 0.0
    clock: Clock | None = None


@dataclass(frozen=True, eq=False)
class Relative(Observation):
    """Observed pose of one photo in the axes of another, e.g. odometry or a calibrated stereo rig.

    t = A_i' (C_j - C_i) and R = A_i' A_j; A is the matrix from photo to object.

    Parameters
    ----------
    first, second
        Names of the photos i and j.
    translation
        (3,) observed t in the axes of photo i (x right, y up, z back towards the viewer), in the linear unit.
    rotation
        (3, 3) observed R; its columns are the axes of photo j in the system of photo i.
    sd
        (6,) standard deviations of the components of t in the linear unit, then of rotations about the axes
        of photo j in radians.
    covariance
        (6, 6) covariance matrix of the same components, instead of `sd`.

    Raises
    ------
    InputError
        If both photos are the same, a value is not finite, or a matrix is not a rotation. If not exactly one
        of `sd` and `covariance` is given with valid weights.
    """

    KIND = "relative"
    PHOTOS = ("first", "second")
    VALUES = (("translation", (3,)), ("rotation", (3, 3)))
    COMPONENTS = (*AXES, *ROTATIONS)

    first: str
    second: str
    translation: ArrayLike
    rotation: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None


@dataclass(frozen=True, eq=False)
class Range(Observation):
    """Observed distance of a point from a rangefinder that moves with a photo.

    The observed value is s = ||P - C - A l||, or m s + k with an instrument.

    Parameters
    ----------
    photo
        Name of the photo; None if a trajectory is observed.
    point
        Name of the point P.
    length
        Observed distance in the linear unit of the object space.
    sd
        Standard deviation of the distance in the same unit.
    lever_arm
        (3,) fixed l, from the projection centre to the rangefinder in the axes of the photo (x right, y up, z
        back towards the viewer), in the linear unit.
    instrument
        Instrument with scale m and constant k; None for 1 and 0.
    trajectory, time, clock
        Trajectory observed at a time in seconds instead of a photo, and clock with unknown offset.

    Raises
    ------
    InputError
        If a length or standard deviation is not positive and finite, or a lever arm is not finite.
    """

    KIND = "range"
    POINTS = ("point",)
    PHOTOS = ("photo",)
    UNKNOWNS = (("instrument", Instrument),)
    VALUES = (("length", ()), ("lever_arm", (3,)))
    COMPONENTS = ("length",)
    _POSITIVE = True

    photo: str | None
    point: str
    length: float
    sd: float
    lever_arm: ArrayLike = 0.0
    instrument: Instrument | None = None
    trajectory: Trajectory | None = None
    time: float = 0.0
    clock: Clock | None = None


@dataclass(frozen=True, eq=False)
class Velocity(Observation):
    """Observed velocity of the GNSS antenna of a moving photo: C' + A [w]x l.

    Parameters
    ----------
    photo
        Name of a photo on a trajectory; None if the trajectory is specified.
    velocity
        (3,) in the linear unit per second along X, Y, Z; geocentric if the object space is geographic.
    sd
        (3,) standard deviations of the velocity, or one for all.
    covariance
        (3, 3) covariance matrix of the velocity, instead of `sd`.
    lever_arm
        (3,) l, from the projection centre to the antenna in the axes of the photo; or an unknown lever arm.
    trajectory, time, clock
        Trajectory observed at a time in seconds instead of a photo, and clock with unknown offset.

    Raises
    ------
    InputError
        If a value is not finite, or weights are invalid: exactly one of `sd` and `covariance` is required.
    """

    KIND = "velocity"
    PHOTOS = ("photo",)
    UNKNOWNS = (("lever_arm", LeverArm),)
    VALUES = (("velocity", (3,)), ("lever_arm", (3,)))
    COMPONENTS = AXES
    _PER = "/s"

    photo: str | None
    velocity: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    lever_arm: ArrayLike | LeverArm = 0.0
    trajectory: Trajectory | None = None
    time: float = 0.0
    clock: Clock | None = None


@dataclass(frozen=True, eq=False)
class Rate(Observation):
    """Observed rotation rate of the body that carries a camera, e.g. a gyroscope: B' w + b.

    Parameters
    ----------
    photo
        Name of a photo on a trajectory; None if the trajectory is specified.
    rate
        (3,) rotation rate about the axes of the body, in radians per second.
    sd
        (3,) standard deviations of the rate, or one for all.
    covariance
        (3, 3) covariance matrix of the rate, instead of `sd`.
    boresight
        (3, 3) B, body to the axes of the photo; or an unknown boresight. None: the identity.
    bias
        Unknown bias b, optional.
    trajectory, time, clock
        Trajectory observed at a time in seconds instead of a photo, and clock with unknown offset.

    Raises
    ------
    InputError
        If a matrix is not a rotation, or weights are invalid: exactly one of `sd` and `covariance` is
        required.
    """

    KIND = "rate"
    PHOTOS = ("photo",)
    UNKNOWNS = (("boresight", Boresight), ("bias", GyroBias))
    VALUES = (("rate", (3,)), ("boresight", (3, 3)))
    COMPONENTS = ROTATIONS
    _PER = "/s"

    photo: str | None
    rate: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    boresight: ArrayLike | Boresight | None = None
    bias: GyroBias | None = None
    trajectory: Trajectory | None = None
    time: float = 0.0
    clock: Clock | None = None
