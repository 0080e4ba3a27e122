"""Observations of shared unknowns: priors, base lengths of rigs, knots of lenses, smooth trajectories."""

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
from photogram.network.observations.columns import Observations, all_trajectories
from photogram.network.observations.observation import Observation
from photogram.network.trajectories import Coefficient, Trajectory
from photogram.network.unknowns import Sensor, Unknown


@dataclass(frozen=True, eq=False)
class Prior(Observation):
    """Prior of a shared unknown: an observation with full covariance.

    Parameters
    ----------
    unknown
        The unknown; its own standard deviations must be infinite.
    sd
        (k,) standard deviations of its components, rotations in radians.
    covariance
        (k, k) covariance matrix of the components, instead of `sd`.
    value
        (k,) observed values, if they differ from the values of the unknown; not for rotations.

    Raises
    ------
    InputError
        If the unknown is invalid, or not exactly one of `sd` and `covariance` is given with valid weights.
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
        what = f"value of {self.name} (not of rotations)"
        value = shaped(what, self.value, (count,), "finite")
        require(count <= 3, what, "finite", value=value.tolist())
        self._set("value", value)
        self._set("observed", value - self.unknown.position[:count])

    @property
    def label(self) -> str:
        """Group of the priors with the same type of unknown."""
        return f"prior, {self.unknown.KIND}" + ("" if self.value is None else ", observed")

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the unknown."""
        return self.unknown.units(linear_unit)

    @property
    def own_components(self) -> tuple[str, ...]:
        """Components of the unknown."""
        return self.unknown.components


@dataclass(frozen=True, eq=False)
class Base(Observation):
    """Observed distance between two sensors on a frame, or between a sensor and the frame.

    The observed value is ||c_2 - c_1||. A measured base length defines the scale of a rig.

    Parameters
    ----------
    first
        First sensor; None for the sensor that represents the frame.
    second
        Second sensor.
    length
        Observed distance in the linear unit of the object space.
    sd
        Standard deviation of the distance in the same unit.

    Raises
    ------
    InputError
        If a sensor is invalid, a value is not finite, or the standard deviation is invalid.
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
    """Observed weighted sum of trajectory coefficients, usually 0.

    Parameters
    ----------
    coefficients
        Coefficients of one trajectory, all of positions or all of rotations.
    factors
        One factor per coefficient.
    observed_sum
        (3,) observed value of the sum, default 0.
    sd
        (3,) standard deviations of x, y, z in the unit of the coefficients, or one for all.
    covariance
        (3, 3) covariance matrix of the sum, instead of `sd`.

    Raises
    ------
    InputError
        If a coefficient is invalid, types differ, or the number of factors is wrong.
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
        factors = shaped("factors of a smoothness", self.factors, (len(own),), "finite")
        self._set("factors", factors)
        total = shaped("observed_sum of a smoothness", self.observed_sum, (3,), "finite")
        self._set("observed", np.concatenate([total, factors]))

    @property
    def label(self) -> str:
        """Group of the observations with the same type and number of coefficients."""
        return f"smoothness, {len(self.coefficients)} {self.coefficients[0].KIND}s"

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the coefficients."""
        return self.coefficients[0].units(linear_unit)

    @property
    def of(self) -> tuple[str, ...]:
        """Names of the coefficients."""
        return tuple(each.name for each in self.coefficients)


def smoothness_of(trajectory: Trajectory) -> list[Observation]:
    """Return the smoothness observations of the coefficients of a trajectory."""
    found: list[Observation] = []
    for basis, own in zip((trajectory.position, trajectory.rotation), trajectory.coefficients, strict=True):
        for numbers, factors, sd in [] if basis is None else basis.smoothed:
            found.append(Smoothness([own[k] for k in numbers], factors, sd=sd))
    return found


def with_smoothness(
    observations: Observations[Observation], trajectories: Sequence[Trajectory]
) -> Observations[Observation]:
    """Add the missing smoothness observations of trajectories."""
    known = {one for each in observations.of_type(Smoothness) for one in each.unknowns}
    missing = [
        each
        for trajectory in all_trajectories(trajectories, observations)
        for each in smoothness_of(trajectory)
        if not known.issuperset(each.unknowns)
    ]
    return Observations.of([observations, *missing]) if missing else observations


def with_knots(
    observations: Observations[Observation], cameras: Sequence[Camera]
) -> Observations[Observation]:
    """Add priors for weighted knots of cameras: 0 radially and across.

    Priors of knots of other cameras are removed.
    """
    own = [knot for camera in cameras for knot in camera.knot_unknowns]
    observed = {each.unknown: each for each in observations.of_type(Prior)}
    others = {prior for knot, prior in observed.items() if isinstance(knot, Knot) and knot not in set(own)}
    if others:
        observations = Observations.of(each for each in observations if each not in others)
    weighted = [each for each in own if each.covariance is not None and each not in observed]
    missing = [Prior(each, covariance=each.covariance, value=np.zeros(2)) for each in weighted]
    return Observations.of([observations, *missing]) if missing else observations
