"""Observations of photos: positions and velocities of GNSS, inertial units, ranges, relative poses."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.observation import AXES, ROTATIONS, Observation, with_unknowns
from photogram.network.trajectories import Clock, GyroBias, Trajectory
from photogram.network.unknowns import Boresight, Drift, Instrument, LeverArm, Shift, Unknown


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
    return [with_unknowns(each, dated) for each in observations] if dated else list(observations)


@dataclass(frozen=True, eq=False)
class Attitude(Observation):
    """The attitude of the body that carries a camera, as an inertial unit gives it: A B.

    Parameters
    ----------
    photo
        Its name; None where it is of a trajectory.
    attitude
        (3, 3) observed, body to object: its columns are the axes of the body in X, Y, Z; or in east, north,
        up at the photo where the object space is geographic.
    sd
        (3,) standard deviations of rotations about the axes of the body in radians, or one for all.
    covariance
        (3, 3) covariance matrix of the same in square radians, in place of `sd`.
    boresight
        (3, 3) B, body to the axes of the photo (x right, y up, z back towards the viewer); or one that is
        unknown. None where what is observed is the attitude of the photo itself.
    trajectory, time, clock
        What it is of in the place of a photo, at a time in seconds, and the offset of that clock.

    Raises
    ------
    InputError
        Matrices that are no rotations, both or none of `sd` and `covariance`, or such as give no weight.
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
    """The pose of one photo in the axes of another: odometry, a calibrated stereo rig.

    t = A_i' (C_j - C_i) and R = A_i' A_j, A being the matrix from photo to object.

    Parameters
    ----------
    first, second
        Names of the photos i and j.
    translation
        (3,) observed t in the axes of photo i (x right, y up, z back towards the viewer), in the linear unit.
    rotation
        (3, 3) observed R: its columns are the axes of photo j in those of photo i.
    sd
        (6,) standard deviations of the components of t in the linear unit, then of rotations about the axes
        of photo j in radians.
    covariance
        (6, 6) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        A photo with itself, values that are not finite, a matrix that is no rotation, both or none of `sd`
        and `covariance`, or such as give no weight.
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
    """The distance of a point from a rangefinder that moves with a photo.

    The norm s of P - C - A l; of an instrument m s + k.

    Parameters
    ----------
    photo
        Its name; None where it is of a trajectory.
    point
        The name of the point P.
    length
        Observed, in the linear unit of the object space.
    sd
        Its standard deviation in the same unit.
    lever_arm
        (3,) l, from the projection centre to the rangefinder in the axes of the photo (x right, y up, z back
        towards the viewer), in the linear unit; known.
    instrument
        Scale m and constant k of the rangefinder; None where these are 1 and 0.
    trajectory, time, clock
        What it is of in the place of a photo, at a time in seconds, and the offset of that clock.

    Raises
    ------
    InputError
        A length or a standard deviation that is not positive and finite, a lever arm that is not finite.
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
    """The velocity of the GNSS antenna of a photo that moves: C' + A [w]x l.

    Parameters
    ----------
    photo
        Its name, on a trajectory; None where it is of a trajectory itself.
    velocity
        (3,) in the linear unit a second, along X, Y, Z; geocentric where the object space is geographic.
    sd
        (3,) standard deviations of the same, or one for all.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.
    lever_arm
        (3,) l, from the projection centre to the antenna in the axes of the photo; or one that is unknown.
    trajectory, time, clock
        What it is of in the place of a photo, at a time in seconds, and the offset of that clock.

    Raises
    ------
    InputError
        Values that are not finite, both or none of `sd` and `covariance`, or such as give no weight.
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
    """The rate of rotation of the body that carries a camera, as a gyroscope gives it: B' w + b.

    Parameters
    ----------
    photo
        Its name, on a trajectory; None where it is of a trajectory itself.
    rate
        (3,) about the axes of the body, in radians a second.
    sd
        (3,) standard deviations of the same, or one for all.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.
    boresight
        (3, 3) B, body to the axes of the photo; or one that is unknown. None: the identity.
    bias
        b; None without.
    trajectory, time, clock
        What it is of in the place of a photo, at a time in seconds, and the offset of that clock.

    Raises
    ------
    InputError
        Matrices that are no rotations, both or none of `sd` and `covariance`, or such as give no weight.
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
