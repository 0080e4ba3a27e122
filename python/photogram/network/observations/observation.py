"""What all kinds of observation have in common."""

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
"""A kind, (k, p) indices of points, (k, q) photos, (k, c) unknowns; (k, v) values, (k, r, r) covariances."""

AXES = ("X", "Y", "Z")
ROTATIONS = ("rotation x", "rotation y", "rotation z")


@dataclass(frozen=True, eq=False)
class Observation:
    """An observation of points, photos and unknowns that it has in common with others.

    A kind is a class of its own: fields for what it is of, what was observed and how well (`sd` or
    `covariance`), and the names below.

    Attributes
    ----------
    points, photos
        Names of what it is of.
    unknowns
        Its common unknowns; None for those that it does without.
    observed
        (v,) what was observed, as the core takes it.
    precision
        (r, r) covariance matrix of its r components.
    """

    KIND: ClassVar[str] = ""
    """The name under which results know the kind."""
    POINTS: ClassVar[tuple[str, ...]] = ()
    """Fields that name points."""
    PHOTOS: ClassVar[tuple[str, ...]] = ()
    """Fields that name photos."""
    UNKNOWNS: ClassVar[tuple[tuple[str, type[Unknown]], ...]] = ()
    """Fields that may be common unknowns, with their type."""
    NEEDS: ClassVar[frozenset[str]] = frozenset()
    """Those that it cannot do without."""
    VALUES: ClassVar[tuple[tuple[str, tuple[int, ...]], ...]] = ()
    """Fields that are numbers, with their shapes, in the order in which the core takes them: of fields that
    are common unknowns what is known instead."""
    COMPONENTS: ClassVar[tuple[str, ...]] = ()
    """What its components are called: rotations are in radians, all others in the linear unit."""
    LOCAL: ClassVar[bool] = False
    """Whether in geographic space these are east, north and up."""
    _PER: ClassVar[str] = ""  # What follows the units of its components: `/s` of rates
    MISSING: ClassVar[bool] = False
    """Whether NaN stands for components that were not observed."""
    _POSITIVE: ClassVar[bool] = False  # Whether its first value, a length, must be positive

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
        """The time on a trajectory that it is of, in the place of a photo."""
        own = vars(self)
        trajectory = own.get("trajectory")
        return None if trajectory is None else Moment(trajectory, float(own["time"]), own["clock"])

    @property
    def of(self) -> tuple[str, ...]:
        """What it is of, by name: points and photos or, where there are none, unknowns."""
        return self.points + self.photos or tuple(each.name for each in self.unknowns if each is not None)

    @property
    def name(self) -> str:
        """Its kind and what it is of, for reports."""
        return f"{self.KIND} {' - '.join(self.of)}"

    @property
    def label(self) -> str:
        """Under which observations stand together in results."""
        return self.KIND

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of its components; nothing for plain numbers."""
        return tuple(
            ("rad" if name in ROTATIONS else linear_unit) + self._PER for name in self.own_components
        )

    @property
    def own_components(self) -> tuple[str, ...]:
        """The names of its components, in rectangular space."""
        return self.COMPONENTS

    def components(self, *, geographic: bool) -> tuple[str, ...]:
        """Return the names of its components; of places in geographic space those of local axes."""
        own = self.own_components
        return ("east", "north", "up")[: len(own)] if geographic and self.LOCAL else own

    @classmethod
    def values_of(cls, observations: Sequence[Observation]) -> Floats:
        """Return (k, v) what the core takes of observations of this kind, all of a block."""
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
        """Check a field and return its numbers; zeros or the identity for common unknowns."""
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
        """Return the covariance matrix; `use` says which components were observed."""
        r = len(self.own_components)
        sd: ArrayLike | None = getattr(self, "sd", None)
        covariance: ArrayLike | None = getattr(self, "covariance", None)
        if sd is not None and covariance is None:
            deviations = shaped(f"sd of {self.name}", sd, (r,), missing=True)
            with np.errstate(over="ignore", under="ignore"):
                own = deviations[use] ** 2
            if not (deviations[use] > 0).all():
                raise argument_error(f"sd of {self.name}", "positive", value=deviations.tolist())
            if not ((own > 0) & np.isfinite(own)).all():  # squares must be numbers
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
    """Return an observation with other common unknowns in the place of some, by the identity of these."""
    fields = zip(observation.UNKNOWNS, observation.unknowns if observation.UNKNOWNS else (), strict=True)
    changes: dict[str, Any] = {name: others[id(own)] for (name, _), own in fields if id(own) in others}
    return replace(observation, **changes) if changes else observation


def moments(observations: Sequence[Observation]) -> list[Moment]:
    """Return the different times on trajectories that observations are of."""
    return list({each.name: each for each in _moments(observations)}.values())


def of_records(observations: Sequence[Observation]) -> list[Unknown]:
    """Return the coefficients and clocks that times on trajectories are made of, each once."""
    found: dict[int, Unknown] = {}
    seen: set[int] = set()
    for each in _moments(observations):
        own: list[Unknown] = []
        # A trajectory has many records, and may have many coefficients.
        if id(each.trajectory) not in seen:
            seen.add(id(each.trajectory))
            own += [one for part in each.trajectory.coefficients for one in part]
        own += [] if each.clock is None else [each.clock]
        found |= {id(one): one for one in own}
    return list(found.values())


def all_trajectories(
    of_photos: Sequence[Trajectory], observations: Sequence[Observation]
) -> list[Trajectory]:
    """Return trajectories of photos, then those of records, each once."""
    of_times = (each.trajectory for each in _moments(observations))
    return list({id(each): each for each in (*of_photos, *of_times)}.values())


def _moments(observations: Sequence[Observation]) -> Iterator[Moment]:
    """Yield the time of each observation that is of one."""
    return (moment for each in observations if (moment := each.moment) is not None)


def observation_rows(
    observations: Sequence[Observation],
    points: Sequence[str],
    photos: Sequence[str],
    unknowns: Sequence[Unknown],
) -> list[tuple[list[int], Group]]:
    """Return observations kind by kind: their rows among the given ones, and what the core takes.

    Times on trajectories stand behind the photos. InputError: a point or photo that is not there.
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
