"""Base class of all observation types."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.arguments.arrays import argument_error, is_covariance, names, number, shaped
from photogram.arguments.objects import kind_error
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.moving_photos import Moment
from photogram.network.trajectories import Clock, Trajectory
from photogram.network.unknowns import Unknown, rotation

Group = tuple[str, Indices, Indices, Indices, Floats, Floats]
"""Type; indices (k, p) of points, (k, q) photos, (k, c) unknowns; values (k, v), covariances (k, r, r)."""

AXES = ("X", "Y", "Z")
ROTATIONS = ("rotation x", "rotation y", "rotation z")


@dataclass(frozen=True, eq=False)
class Observation:
    """Observation of points, photos and unknowns that may be shared with other observations.

    Each type is a class with fields for points, photos or unknowns, for observed values and for `sd` or
    `covariance`, and with the class attributes below.

    Attributes
    ----------
    points, photos
        Names of the observed points and photos.
    unknowns
        Shared unknowns; None for an optional one that is not used.
    observed
        (v,) observed values in the order of the core.
    precision
        (r, r) covariance matrix of the r components.
    """

    KIND: ClassVar[str] = ""
    """Name of the type in results."""
    POINTS: ClassVar[tuple[str, ...]] = ()
    """Fields with names of points."""
    PHOTOS: ClassVar[tuple[str, ...]] = ()
    """Fields with names of photos."""
    UNKNOWNS: ClassVar[tuple[tuple[str, type[Unknown]], ...]] = ()
    """Fields for shared unknowns, with their classes."""
    NEEDS: ClassVar[frozenset[str]] = frozenset()
    """Fields of unknowns that are required."""
    VALUES: ClassVar[tuple[tuple[str, tuple[int, ...]], ...]] = ()
    """Numeric fields with shapes, in the order of the core. A field with a shared unknown counts as 0."""
    COMPONENTS: ClassVar[tuple[str, ...]] = ()
    """Names of the components; rotations are in radians, others in the linear unit."""
    LOCAL: ClassVar[bool] = False
    """Whether components are east, north and up in geographic space."""
    _PER: ClassVar[str] = ""  # Suffix of the units: `/s` for rates
    MISSING: ClassVar[bool] = False
    """Whether NaN marks components that were not observed."""
    _POSITIVE: ClassVar[bool] = False  # Whether the first value, a length, must be positive

    points: tuple[str, ...] = field(init=False, repr=False)
    photos: tuple[str, ...] = field(init=False, repr=False)
    unknowns: tuple[Unknown | None, ...] = field(init=False, repr=False)
    observed: Floats = field(init=False, repr=False)
    precision: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        given = {name: getattr(self, name, None) for name in ("trajectory", "clock")}
        for (name, value), kind in zip(given.items(), (Trajectory, Clock), strict=True):
            if value is not None and not isinstance(value, kind):
                raise kind_error(f"{name} of the {self.KIND}", f"{kind.__name__} or None", value)
        if given["clock"] is not None and given["trajectory"] is None:
            raise argument_error(self.KIND, "requires", name="clock", other="trajectory")
        if hasattr(self, "time"):
            time = number(f"time of the {self.KIND}", self.time)
            if not np.isfinite(time):
                raise argument_error(f"time of the {self.KIND}", "finite", value=time)
            self._set("time", time)
        moment = self.moment
        self._set("points", tuple(names(self.KIND, [getattr(self, name) for name in self.POINTS])))
        of = [getattr(self, name) for name in self.PHOTOS]
        if moment is not None and any(each is not None for each in of):
            raise argument_error(self.KIND, "exclusive", first="photo", second="trajectory")
        self._set("photos", tuple(names(self.KIND, of if moment is None else [moment.name])))
        self._set("unknowns", tuple(self._unknown(name, kind) for name, kind in self.UNKNOWNS))
        known = [id(each) for each in self.unknowns if each is not None]
        for kind_of, own in (("point", self.points), ("photo", self.photos), ("unknown", known)):
            if len(set(own)) < len(own):
                raise argument_error(self.KIND, "repeated", kind=kind_of, name=self.of[0])
        values = [np.ravel(self._value(name, shape)) for name, shape in self.VALUES]
        self._set("observed", np.concatenate(values) if values else np.zeros(0))
        use = np.ones(len(self.own_components), dtype=bool)
        if self.MISSING:
            use = ~np.isnan(self.observed)
        if not use.any():
            raise argument_error(self.name, "missing", name="an observed component")
        self._set("precision", self._covariance(use))
        if self._POSITIVE and not self.observed[0] > 0:
            name = self.VALUES[0][0]
            raise argument_error(f"{name} of {self.name}", "positive", value=getattr(self, name))

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    @property
    def moment(self) -> Moment | None:
        """Time on a trajectory to which the observation refers, instead of a photo."""
        own = vars(self)
        trajectory = own.get("trajectory")
        return None if trajectory is None else Moment(trajectory, float(own["time"]), own["clock"])

    @property
    def of(self) -> tuple[str, ...]:
        """Names of the observed points and photos; without these, names of the unknowns."""
        return self.points + self.photos or tuple(each.name for each in self.unknowns if each is not None)

    @property
    def name(self) -> str:
        """Observation type and observed objects, for reports."""
        return f"{self.KIND} {' - '.join(self.of)}"

    @property
    def label(self) -> str:
        """Name of the group of the observation in results."""
        return self.KIND

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the components; empty for dimensionless numbers."""
        return tuple(
            ("rad" if name in ROTATIONS else linear_unit) + self._PER for name in self.own_components
        )

    @property
    def own_components(self) -> tuple[str, ...]:
        """Names of the components in rectangular space."""
        return self.COMPONENTS

    def components(self, *, geographic: bool) -> tuple[str, ...]:
        """Return the names of the components; east, north, up for positions in geographic space."""
        own = self.own_components
        return ("east", "north", "up")[: len(own)] if geographic and self.LOCAL else own

    @classmethod
    def values_of(cls, observations: Sequence[Observation]) -> Floats:
        """Return the values (k, v) for the core of all observations of this type in a block."""
        return np.stack([each.observed for each in observations])

    def _unknown(self, name: str, kind: type[Unknown]) -> Unknown | None:
        value = getattr(self, name)
        if isinstance(value, kind):
            return value
        known = (value is None and name not in self.NEEDS) or name in dict(self.VALUES)
        if isinstance(value, Unknown) or not known:
            raise kind_error(f"{name} of {self.KIND}", f"an object of the class {kind.__name__}", value)
        return None

    def _value(self, name: str, shape: tuple[int, ...]) -> Floats:
        """Validate a field and return its numbers; zeros or the identity for shared unknowns."""
        value = getattr(self, name)
        turns = shape == (3, 3)
        if isinstance(value, Unknown) or (value is None and turns):
            return np.eye(3) if turns else np.zeros(shape)
        array = shaped(f"{name} of {self.name}", value, shape, missing=self.MISSING)
        if (np.isinf(array) if self.MISSING else ~np.isfinite(array)).any():
            raise argument_error(f"{name} of {self.name}", "finite", value=array.tolist())
        if turns:
            rotation(f"{name} of {self.name}", array)
        self._set(name, array if shape else float(array))
        return array

    def _covariance(self, use: NDArray[np.bool_]) -> Floats:
        """Return the covariance matrix of the observed components `use`."""
        r = len(self.own_components)
        sd: ArrayLike | None = getattr(self, "sd", None)
        covariance: ArrayLike | None = getattr(self, "covariance", None)
        if sd is not None and covariance is None:
            deviations = shaped(f"sd of {self.name}", sd, (r,), missing=True)
            with np.errstate(over="ignore", under="ignore"):
                own = deviations[use] ** 2
            if not (deviations[use] > 0).all():
                raise argument_error(f"sd of {self.name}", "positive", value=deviations.tolist())
            if not ((own > 0) & np.isfinite(own)).all():  # squares must be finite and not 0
                raise argument_error(
                    f"sd of {self.name}", "range", low=1e-150, high=1e150, value=deviations.tolist()
                )
            return np.asarray(np.diag(np.where(use, deviations, 1.0) ** 2))
        if sd is not None or covariance is None:
            raise argument_error(self.name, "exclusive", first="sd", second="covariance")
        matrix = shaped(f"covariance of {self.name}", covariance, (r, r), missing=True)
        if not is_covariance(matrix[np.ix_(use, use)]):
            raise argument_error(self.name, "covariance")
        return matrix


def with_unknowns(observation: Observation, others: Mapping[int, Unknown]) -> Observation:
    """Replace shared unknowns of an observation; keys of `others` are object identities."""
    fields = zip(observation.UNKNOWNS, observation.unknowns if observation.UNKNOWNS else (), strict=True)
    changes: dict[str, Any] = {name: others[id(own)] for (name, _), own in fields if id(own) in others}
    return replace(observation, **changes) if changes else observation


def moments(observations: Sequence[Observation]) -> list[Moment]:
    """Return the different times on trajectories to which observations refer."""
    return list({each.name: each for each in _moments(observations)}.values())


def of_records(observations: Sequence[Observation]) -> list[Unknown]:
    """Return the trajectory coefficients and clocks of record times, each once."""
    found: dict[int, Unknown] = {}
    seen: set[int] = set()
    for each in _moments(observations):
        own: list[Unknown] = []
        # A trajectory has many records, and possibly many coefficients.
        if id(each.trajectory) not in seen:
            seen.add(id(each.trajectory))
            own += [one for part in each.trajectory.coefficients for one in part]
        own += [] if each.clock is None else [each.clock]
        found |= {id(one): one for one in own}
    return list(found.values())


def all_trajectories(
    of_photos: Sequence[Trajectory], observations: Sequence[Observation]
) -> list[Trajectory]:
    """Return the trajectories of photos, then of records, each once."""
    of_times = (each.trajectory for each in _moments(observations))
    return list({id(each): each for each in (*of_photos, *of_times)}.values())


def _moments(observations: Sequence[Observation]) -> Iterator[Moment]:
    """Yield the trajectory times of observations."""
    return (moment for each in observations if (moment := each.moment) is not None)


def observation_rows(
    observations: Sequence[Observation],
    points: Sequence[str],
    photos: Sequence[str],
    unknowns: Sequence[Unknown],
) -> list[tuple[list[int], Group]]:
    """Group observations by type: their row indices, and their arrays for the core.

    Record times follow the photos. InputError if a point or photo is not in the block.
    """
    if not observations:
        return []
    all_photos = [*photos, *(each.name for each in moments(observations))]
    of_points, of_photos = ({name: row for row, name in enumerate(each)} for each in (points, all_photos))
    of_unknowns = {id(each): row for row, each in enumerate(unknowns)}

    def places(each: Observation, own: tuple[str, ...], known: dict[str, int], what: str) -> list[int]:
        for name in own:
            if name not in known:
                raise argument_error(f"observation {each.name}", "absent", kind=what, name=name)
        return [known[name] for name in own]

    alike: dict[tuple[str, int, int, int], list[int]] = {}
    for row, each in enumerate(observations):
        widths = len(each.unknowns), len(each.observed), len(each.precision)
        alike.setdefault((each.label, *widths), []).append(row)
    groups: list[tuple[list[int], Group]] = []
    for rows in alike.values():
        own = [observations[row] for row in rows]
        indices = (
            [places(each, each.points, of_points, "point") for each in own],
            [places(each, each.photos, of_photos, "photo") for each in own],
            [[-1 if one is None else of_unknowns[id(one)] for one in each.unknowns] for each in own],
        )
        first, second, third = (np.array(table, dtype=np.int64) for table in indices)
        values = type(own[0]).values_of(own)
        covariances = np.stack([each.precision for each in own])
        groups.append((rows, (own[0].KIND, first, second, third, values, covariances)))
    return groups
