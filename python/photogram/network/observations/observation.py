"""Base class of all observation types, and the validation of their fields."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING as REQUIRED
from typing import Any, ClassVar, Self

import numpy as np

from photogram.arguments.arrays import argument_error, is_covariance, length, names, numbers, shaped
from photogram.arguments.objects import kind_error, require, require_kind
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass, field, fields, replace
from photogram.network.moving_photos import Moment
from photogram.network.observations.columns import Columns, Observations, record_moment
from photogram.network.trajectories import Clock, Trajectory
from photogram.network.unknowns import ROTATION, Unknown, are_rotations

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
        given = {name: [value] for name, value in vars(self).items()}
        self._set_columns(_related(type(self), 1, given))
        components = len(self.own_components)
        self._set_columns(_measured(type(self), None, vars(self), components, lambda _: self.name))

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def _set_columns(self, columns: Mapping[str, Sequence[Any]]) -> None:
        vars(self).update({name: column[0] for name, column in columns.items()})

    @classmethod
    def from_arrays(cls, **columns: Any) -> Observations[Self]:
        """Create many observations of this type from arrays, faster than one by one.

        Parameters
        ----------
        columns
            Arguments of the class by name. Names of points and photos are lists of n names. Numbers are
            arrays with one row for each observation, or one value for all. Unknowns, trajectories and clocks
            are one object for all, or a list of n objects.

        Returns
        -------
        n observations: a sequence for the argument `observations` of a block, or a part of it.

        Raises
        ------
        InputError
            If an argument is unknown or missing, an array has a wrong shape, or the class rejects a row.

        Examples
        --------
        >>> import numpy as np
        >>> from photogram import Position
        >>> observed = Position.from_arrays(photo=["1", "2"], position=np.zeros((2, 3)), sd=0.05)
        >>> len(observed), observed[1].photo
        (2, '2')
        """
        usable = cls.__post_init__ is Observation.__post_init__
        require(usable, "from_arrays", "kind", kind="called for a type with declared columns", value=cls.KIND)
        given = {each.name: each.default for each in fields(cls) if each.init}
        for name in columns:
            require(name in given, cls.__name__, "unknown", kind="argument", name=name, names=list(given))
        given |= columns
        for name, value in given.items():
            require(value is not REQUIRED, cls.__name__, "missing", name=name)
        named = [name for name in (*cls.POINTS, *cls.PHOTOS) if given[name] is not None]
        first = named[0] if named else cls.VALUES[0][0]
        column: Any = given[first]
        count = length(first, column)
        if not count:
            return Observations()
        table = {name: _each(value, count, named=name in named) for name, value in given.items()}
        for name, own in table.items():
            require(len(own) == count, name, "count", count=count, actual=len(own))
        if "time" in given:
            times: Any = given["time"]
            table["time"] = times
        table |= _related(cls, count, table)

        def title(row: int) -> str:
            return f"{cls.KIND} {' - '.join(table['points'][row] + table['photos'][row])}"

        table |= _measured(cls, count, given, len(cls.COMPONENTS), title)
        return Observations([Columns(cls, cls.KIND, np.arange(count), table)])

    @property
    def moment(self) -> Moment | None:
        """Time on a trajectory to which the observation refers, instead of a photo."""
        own = vars(self)
        return record_moment(own.get("trajectory"), own.get("time"), own.get("clock"))

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
    def core_values(cls, observed: Floats, unknowns: Sequence[tuple[Unknown | None, ...]]) -> Floats:
        """Return the values (k, v) for the core of all observations of this type in a block."""
        return observed


def _each(value: Any, count: int, *, named: bool) -> Sequence[Any]:
    """Return a column: a list of names or objects as it is, or one value for all rows."""
    objects = isinstance(value, list | tuple) and all(
        each is None or isinstance(each, Unknown | Trajectory) for each in value
    )
    return list(value) if named or objects else [value] * count


def _related(kind: type[Observation], count: int, given: Mapping[str, Sequence[Any]]) -> dict[str, Any]:
    """Validate the times, points, photos and unknowns of observations, and return their columns."""
    none: Sequence[Any] = [None] * count
    found: dict[str, Any] = {}
    if "time" in given:
        found["time"] = shaped(f"time of the {kind.KIND}", given["time"], (count,), "finite").tolist()
    trajectories, clocks = (given.get(name, none) for name in ("trajectory", "clock"))
    for name, column, of in (("trajectory", trajectories, Trajectory), ("clock", clocks, Clock)):
        for value in _distinct(column):
            require_kind(f"{name} of the {kind.KIND}", value, of, optional=True)
    points, photos = ([given[name] for name in own] for own in (kind.POINTS, kind.PHOTOS))
    for trajectory, clock in zip(trajectories, clocks, strict=True) if any(clocks) else ():
        alone = clock is not None and trajectory is None
        require(not alone, kind.KIND, "requires", name="clock", other="trajectory")
    if any(trajectories):
        moments = [*map(record_moment, trajectories, found["time"], clocks)]
        pairs = list(zip(moments, *photos, strict=True))
        both = any(own and each is not None for own, each in pairs)
        require(not both, kind.KIND, "exclusive", first="photo", second="trajectory")
        photos = [[own.name if own else each for own, each in pairs]]
    for name, columns in (("points", points), ("photos", photos)):
        found[name] = list(zip(*(names(kind.KIND, each) for each in columns), strict=True)) or [()] * count
    unknowns = []
    for name, kind_of in kind.UNKNOWNS:
        known = {id(value): _unknown(kind, name, kind_of, value) for value in _distinct(given[name])}
        unknowns.append([*map(known.get, map(id, given[name]))])
    found["unknowns"] = list(zip(*unknowns, strict=True)) or [()] * count
    for name in ("points", "photos", "unknowns"):
        for row in set(found[name]) if count and len(found[name][0]) > 1 else ():
            own = [each for each in row if each is not None]
            title = getattr(own[0], "name", own[0]) if own else ""
            require(len(set(own)) == len(own), kind.KIND, "repeated", kind=name[:-1], name=title)
    return found


def _distinct(column: Sequence[Any]) -> Iterable[Any]:
    if len(column) < 2 or column.count(column[0]) == len(column):
        return column[:1]
    return {id(value): value for value in column}.values()


def _unknown(kind: type[Observation], name: str, kind_of: type[Unknown], value: object) -> Unknown | None:
    if isinstance(value, kind_of):
        return value
    known = (value is None and name not in kind.NEEDS) or name in dict(kind.VALUES)
    if isinstance(value, Unknown) or not known:
        raise kind_error(f"{name} of {kind.KIND}", f"an object of the class {kind_of.__name__}", value)
    return None


def _measured(
    kind: type[Observation],
    count: int | None,
    given: Mapping[str, Any],
    components: int,
    title: Callable[[int], str],
) -> dict[str, Any]:
    """Validate the numbers of observations, and return their columns; `count` is None for a single one."""
    found: dict[str, Any] = {}
    k = count or 1
    where = title(0) if count is None else kind.KIND

    def reject(bad: Bools, name: str, code: str, values: Floats, /, **fields: object) -> None:
        if bad.any():
            row = int(np.argmax(bad.reshape(k, -1).any(axis=1)))
            what = f"{name} of {title(row)}" if name else title(row)
            raise argument_error(what, code, **{"value": values[row].tolist()} | fields)

    observed = [np.zeros((k, 0))]
    for name, shape in kind.VALUES:
        value, turns = given[name], shape == (3, 3)
        first = value[0] if isinstance(value, list) and value else value
        if (value is None and turns) or isinstance(first, Unknown):
            observed.append(
                np.broadcast_to(np.eye(3) if turns else np.zeros(shape), (k, *shape)).reshape(k, -1)
            )
            continue
        array = _rows(f"{name} of {where}", value, shape, count, missing=kind.MISSING)
        reject(np.isinf(array) if kind.MISSING else ~np.isfinite(array), name, "finite", array)
        if turns:
            reject(~are_rotations(array), name, "kind", array, kind=ROTATION)
        if kind._POSITIVE and name == kind.VALUES[0][0]:
            reject(~(array > 0), name, "positive", array)
        found[name] = array if shape else array.tolist()
        observed.append(array.reshape(k, -1))
    found["observed"] = np.concatenate(observed, axis=1)
    found["observed"].flags.writeable = False
    use: Any = True
    if kind.MISSING:
        use = ~np.isnan(found["observed"])
        reject(~use.any(axis=1), "", "missing", use, name="an observed component")
    sd: Any = given.get("sd")
    covariance: Any = given.get("covariance")
    require((sd is None) != (covariance is None), where, "exclusive", first="sd", second="covariance")
    if covariance is None:
        deviations = _rows(f"sd of {where}", sd, (components,), count, missing=True)
        reject(~(deviations > 0) & use, "sd", "positive", deviations)
        used = deviations if use is True else np.where(use, deviations, 1.0)
        with np.errstate(over="ignore", under="ignore"):
            variances = used**2
        usable = (variances > 0) & (variances < np.inf)
        reject(~usable, "sd", "range", deviations, low=1e-150, high=1e150)
        found["precision"] = variances[:, :, np.newaxis] * np.eye(components)
        if count is not None and np.ndim(sd) > (components > 1):
            found["sd"] = deviations if components > 1 else deviations[:, 0].tolist()
    else:
        matrices = _rows(f"covariance of {where}", covariance, (components, components), count, missing=True)
        used = matrices
        if use is not True:
            used = np.where(use[:, :, np.newaxis] & use[:, np.newaxis], matrices, np.eye(components))
        reject(~is_covariance(used), "", "covariance", matrices)
        found["precision"] = matrices
        if np.ndim(covariance) > 2:
            found["covariance"] = matrices
    return found


def _rows(name: str, value: Any, shape: tuple[int, ...], count: int | None, *, missing: bool) -> Floats:
    """Return (count, *shape) numbers, a row for each observation or one for all; (1, *shape) for None."""
    if count is None:
        return shaped(name, value, shape, missing=missing)[np.newaxis]
    array = numbers(name, value, missing=missing)
    if shape == (1,) and array.shape == (count,):
        array = array[:, np.newaxis]
    return shaped(name, array, (count, *shape), missing=missing, one_row=True)


def checked_observations(given: object) -> Observations[Observation]:
    if isinstance(given, Observations):
        return given
    if not isinstance(given, Sequence):
        raise argument_error("observations", "list", value=given)
    for row, each in enumerate(given):
        if not (isinstance(each, Observations) or (isinstance(each, Observation) and each.KIND)):
            raise kind_error(f"observations[{row}]", "an Observation", each)
    return Observations.of(given)


def with_unknowns(observation: Observation, others: Mapping[int, Unknown]) -> Observation:
    """Replace shared unknowns of an observation; keys of `others` are object identities."""
    own = zip(observation.UNKNOWNS, observation.unknowns if observation.UNKNOWNS else (), strict=True)
    changes: dict[str, Any] = {name: others[id(each)] for (name, _), each in own if id(each) in others}
    return replace(observation, **changes) if changes else observation
