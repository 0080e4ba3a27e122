"""Observations of unknowns and marks: priors, films, base lengths, knots, smooth trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import names, object_name, shaped
from photogram.arguments.fields import check_fields
from photogram.arguments.objects import kind_error, require
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import listed
from photogram.network.cameras import Camera
from photogram.network.films import Film, FilmPlacement, FilmSize, Mark, Roll
from photogram.network.observations.columns import Observations, all_trajectories
from photogram.network.observations.observation import Observation
from photogram.network.passages import Knot
from photogram.network.trajectories import Coefficient, Trajectory
from photogram.network.unknowns import Sensor, Unknown

FILM = ("t1", "t2", "theta", "m", "b1", "b2")  # Unknowns of the film of a photo: mm, radians, ratios


@dataclass(frozen=True, eq=False)
class Fiducial(Observation):
    """Observed reading of a fiducial mark on a photo.

    Parameters
    ----------
    photo
        Name of the photo, for reports.
    mark
        Position of the mark in the camera frame, one object for all photos of the camera.
    film
        Film of the photo.
    reading
        (2,) reading in the unit of the scanner.
    sd
        (2,) standard deviations of the reading, or one for both.
    covariance
        (2, 2) covariance matrix of the reading, instead of `sd`.

    Raises
    ------
    InputError
        If mark or film is invalid, a value is not finite, or standard deviations are invalid.
    """

    KIND = "fiducial"
    VALUES = (("reading", (2,)),)
    COMPONENTS = ("x", "y")

    photo: str = field(metadata={"check": object_name})
    mark: Mark
    film: Film
    reading: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        check_fields(self, "a fiducial")
        super().__post_init__()
        self._set("unknowns", (self.mark, *self.film.unknowns))
        near = self.mark.position[:2]
        self._set("observed", np.concatenate([self.observed, near, self.film.numbers()]))

    @property
    def of(self) -> tuple[str, ...]:
        """Names of the photo and the mark."""
        return self.photo, self.mark.name

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the readings."""
        return ("mm" if self.film.readings.pitch == 1.0 else "px",) * 2


@dataclass(frozen=True, eq=False)
class KnownFilm(Observation):
    """Prior of t1, t2, theta, m, b1 or b2 of the film of a photo; m may refer to its roll.

    Parameters
    ----------
    photo
        Name of the photo, for reports.
    placement, size
        Placement and size of the film; standard deviations of the observed components must be infinite.
    roll
        Roll to which m refers; None: m is the whole size change.
    known
        (k,) names of the observed components.
    values
        (k,) observed values.
    sd
        (k,) standard deviations of the values, or one for all.
    covariance
        (k, k) covariance matrix of the values, instead of `sd`.

    Raises
    ------
    InputError
        If a name is invalid, a value is not finite, or standard deviations are invalid.
    """

    KIND = "film"
    UNKNOWNS = (("placement", FilmPlacement), ("size", FilmSize), ("roll", Roll))
    NEEDS = frozenset({"placement", "size"})

    photo: str
    placement: FilmPlacement
    size: FilmSize
    roll: Roll | None
    known: Sequence[str]
    values: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._set("photo", names("film", [self.photo])[0])
        known = tuple(self.known)
        if not set(known) <= set(FILM) or len(set(known)) < len(known) or not known:
            raise kind_error(f"known of the film of {self.photo}", f"some of {', '.join(FILM)}", known)
        self._set("known", known)
        super().__post_init__()
        values = shaped(f"values of {self.name}", self.values, (len(known),), "finite")
        self._set("observed", np.concatenate([[FILM.index(name) for name in known], values]))

    @property
    def of(self) -> tuple[str, ...]:
        """Name of the photo."""
        return (self.photo,)

    @property
    def label(self) -> str:
        """Group of the priors with the same components."""
        same = self.known == FILM[3:]
        return self.KIND if same else f"{self.KIND}, {' '.join(self.known)}"

    @property
    def own_components(self) -> tuple[str, ...]:
        """Names of the observed components; m may refer to the roll."""
        about = "m" if self.roll is None else "m - roll"
        return tuple(about if name == "m" else name for name in self.known)

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the observed components."""
        return tuple({"t1": "mm", "t2": "mm", "theta": "rad"}.get(name, "") for name in self.known)


@dataclass(frozen=True, eq=False)
class KnownTogether(Observation):
    """Joint prior of several unknowns with full covariance, e.g. from a certificate or calibration.

    Parameters
    ----------
    title
        Name of the group in results, e.g. `certificate` or `scanner`.
    joined
        The unknowns; their own standard deviations must be infinite.
    sd
        (k,) standard deviations of all components.
    covariance
        (k, k) covariance matrix of all components, instead of `sd`.

    Raises
    ------
    InputError
        If an unknown is invalid, or weights are invalid: exactly one of `sd` and `covariance` is required.
    """

    KIND = "prior"

    title: str
    joined: Sequence[Unknown]
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._set("title", names("prior", [self.title])[0])
        own = tuple(self.joined)
        if not own or not all(isinstance(each, Unknown) for each in own):
            raise kind_error(f"joined of {self.title}", "a list of unknowns", self.joined)
        different = len({id(each) for each in own}) == len(own)
        require(different, f"joined of {self.title}", "repeated", kind="unknown", name=own[0].name)
        self._set("joined", own)
        super().__post_init__()
        self._set("unknowns", own)
        widths = [len(each.components) for each in own] if len(own) > 1 else []
        self._set("observed", np.array(widths, dtype=float))

    @property
    def of(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return tuple(each.name for each in self.joined)

    @property
    def name(self) -> str:
        """Title and names of the unknowns."""
        return f"{self.title} {listed(list(self.of), 4)}"

    @property
    def label(self) -> str:
        """Title of the prior."""
        return self.title

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the unknowns."""
        return tuple(unit for each in self.joined for unit in each.units(linear_unit))

    @property
    def own_components(self) -> tuple[str, ...]:
        """Components of the unknowns, with names of the unknowns if there are several."""
        if len(self.joined) == 1:
            return self.joined[0].components
        return tuple(f"{each.name} {name}" for each in self.joined for name in each.components)


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
    found: list[Observation] = []
    for basis, own in zip((trajectory.position, trajectory.rotation), trajectory.coefficients, strict=True):
        for numbers, factors, sd in [] if basis is None else basis.smoothed:
            found.append(Smoothness([own[k] for k in numbers], factors, sd=sd))
    return found


def with_smoothness(
    observations: Observations[Observation], trajectories: Sequence[Trajectory]
) -> Observations[Observation]:
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
    own = dict.fromkeys(knot for camera in cameras for knot in camera.knot_unknowns)
    observed = {each.unknown: each for each in observations.of_type(Prior)}
    others = {prior for knot, prior in observed.items() if isinstance(knot, Knot) and knot not in own}
    if others:
        observations = Observations.of(each for each in observations if each not in others)
    weighted = [each for each in own if each.covariance is not None and each not in observed]
    missing = [Prior(each, covariance=each.covariance, value=np.zeros(2)) for each in weighted]
    return Observations.of([observations, *missing]) if missing else observations
