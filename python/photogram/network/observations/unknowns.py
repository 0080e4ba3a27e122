"""Observations of common unknowns alone: priors, bases of rigs, knots of lenses, smooth trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import shaped
from photogram.arguments.objects import kind_error, require
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.network.knots import Knot
from photogram.network.observations.observation import Observation, all_trajectories
from photogram.network.trajectories import Coefficient, Trajectory
from photogram.network.unknowns import Sensor, Unknown


@dataclass(frozen=True, eq=False)
class Prior(Observation):
    """What was observed of a common unknown as one observation with its full covariance.

    Parameters
    ----------
    unknown
        The unknown; its own standard deviations are infinite.
    sd
        (k,) standard deviations of its unknowns, rotations in radians.
    covariance
        (k, k) their covariance matrix, in place of `sd`.
    value
        (k,) what was observed of them, in the place of what the unknown is given; not of rotations.

    Raises
    ------
    InputError
        What is no unknown, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "prior"
    UNKNOWNS = (("unknown", Unknown),)
    NEEDS = frozenset({"unknown"})

    unknown: Unknown
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    value: ArrayLike | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.value is None:
            return
        count = len(self.unknown.components)
        value = shaped(f"value of {self.name}", self.value, (count,))
        good = np.isfinite(value).all() and count <= 3
        require(good, f"value of {self.name} (not of rotations)", "finite", value=value.tolist())
        self._set("value", value)
        self._set("observed", value - self.unknown.position[:count])

    @property
    def label(self) -> str:
        """Those of one type stand together."""
        return f"prior, {self.unknown.KIND}" + ("" if self.value is None else ", observed")

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Those of the unknown."""
        return self.unknown.units(linear_unit)

    @property
    def own_components(self) -> tuple[str, ...]:
        """Those of the unknown."""
        return self.unknown.components


@dataclass(frozen=True, eq=False)
class Base(Observation):
    """The distance between two sensors on a frame, or of one from the frame itself.

    The norm of c_2 - c_1; a base that was measured gives a rig its scale.

    Parameters
    ----------
    first
        The first sensor; None for that which stands for the frame.
    second
        The second sensor.
    length
        Observed, in the linear unit of the object space.
    sd
        Its standard deviation in the same unit.

    Raises
    ------
    InputError
        What is no sensor, values that are not finite, a standard deviation that gives no weight.
    """

    KIND = "base"
    UNKNOWNS = (("first", Sensor), ("second", Sensor))
    NEEDS = frozenset({"second"})
    VALUES = (("length", ()),)
    COMPONENTS = ("length",)

    first: Sensor | None
    second: Sensor
    length: float
    sd: float


@dataclass(frozen=True, eq=False)
class Smoothness(Observation):
    """A sum of coefficients of a trajectory, each with its factor, that was observed: most often as zero.

    Parameters
    ----------
    coefficients
        Of one trajectory, all of positions or all of rotations.
    factors
        As many numbers.
    observed_sum
        (3,) what was observed; most often 0.
    sd
        (3,) standard deviations of x, y, z in the unit of the coefficients, or one for all.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        What is no coefficient, coefficients of two kinds, more or fewer factors.
    """

    KIND: ClassVar[str] = "smoothness"
    COMPONENTS: ClassVar[tuple[str, ...]] = ("x", "y", "z")

    coefficients: Sequence[Coefficient]
    factors: ArrayLike
    observed_sum: ArrayLike = 0.0
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        own = tuple(self.coefficients) if isinstance(self.coefficients, Sequence) else ()
        if not all(isinstance(each, Coefficient) for each in own) or len({each.KIND for each in own}) != 1:
            raise kind_error("coefficients of a smoothness", "coefficients of one kind", self.coefficients)
        different = len({id(each) for each in own}) == len(own)
        require(different, "smoothness", "repeated", kind="coefficient", name=own[0].name)
        self._set("coefficients", own)
        super().__post_init__()
        self._set("unknowns", own)
        factors = shaped("factors of a smoothness", self.factors, (len(own),))
        self._set("factors", factors)
        observed = np.concatenate([shaped("observed_sum", self.observed_sum, (3,)), factors])
        require(np.isfinite(observed).all(), f"values of {self.name}", "finite", value=observed.tolist())
        self._set("observed", observed)

    @property
    def label(self) -> str:
        """Those of one kind and number of coefficients stand together."""
        return f"smoothness, {len(self.coefficients)} {self.coefficients[0].KIND}s"

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Those of the coefficients."""
        return self.coefficients[0].units(linear_unit)

    @property
    def of(self) -> tuple[str, ...]:
        """The coefficients."""
        return tuple(each.name for each in self.coefficients)


def smoothness_of(trajectory: Trajectory) -> list[Observation]:
    """Return what is observed of the coefficients of a trajectory together."""
    found: list[Observation] = []
    for basis, own in zip((trajectory.position, trajectory.rotation), trajectory.coefficients, strict=True):
        for numbers, factors, sd in [] if basis is None else basis.smoothed:
            found.append(Smoothness([own[k] for k in numbers], factors, sd=sd))
    return found


def with_smoothness(
    observations: Sequence[Observation], trajectories: Sequence[Trajectory]
) -> tuple[Observation, ...]:
    """Return observations with those of trajectories that are not among them."""
    known: set[Unknown | None] = set()
    for each in observations:
        if isinstance(each, Smoothness):
            known.update(each.unknowns)
    found = list(observations)
    for trajectory in all_trajectories(trajectories, observations):
        found += [each for each in smoothness_of(trajectory) if not known.issuperset(each.unknowns)]
    return tuple(found)


def with_knots(observations: Sequence[Observation], cameras: Sequence[Camera]) -> tuple[Observation, ...]:
    """Return observations with those of the weighted knots of cameras: each is zero, radially and across.

    Those of knots of other cameras go.
    """
    own = [knot for camera in cameras for knot in camera.knot_unknowns]
    there = {id(each) for each in own}
    found = [
        each
        for each in observations
        if not (isinstance(each, Prior) and isinstance(each.unknown, Knot) and id(each.unknown) not in there)
    ]
    observed = {id(each.unknown) for each in found if isinstance(each, Prior)}
    weighted = [each for each in own if each.covariance is not None and id(each) not in observed]
    return (*found, *(Prior(each, covariance=each.covariance, value=np.zeros(2)) for each in weighted))
