"""Observations as columns by type: their rows as objects, and their arrays for the core."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from photogram.arguments.arrays import argument_error
from photogram.arguments.equality import alike
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, fields, replace
from photogram.network.moving_photos import Moment
from photogram.network.trajectories import Clock, Trajectory
from photogram.network.unknowns import Unknown

_Row = TypeVar("_Row", covariant=True)
_Kind = TypeVar("_Kind")

Group = tuple[str, Indices, Indices, Indices, Floats, Floats]
"""Type; indices (k, p) of points, (k, q) photos, (k, c) unknowns; values (k, v), covariances (k, r, r)."""

_SIZES = ("unknowns", "observed", "precision")


def record_moment(trajectory: Trajectory | None, time: float | None, clock: Clock | None) -> Moment | None:
    """Return the time on a trajectory to which an observation refers; None for a photo."""
    return None if trajectory is None or time is None else Moment(trajectory, time, clock)


@dataclass(frozen=True, eq=False)
class Columns:
    """Observations of one type: their row numbers in the block, and a column for each field."""

    kind: type[Any]
    label: str
    rows: Indices
    table: Mapping[str, Sequence[Any]]

    @classmethod
    def of(cls, objects: Mapping[int, Any]) -> Columns:
        """Create the columns of similar observations by row number."""
        own = list(objects.values())
        table: dict[str, Any] = {
            each.name: [getattr(one, each.name) for one in own] for each in fields(own[0])
        }
        table |= {name: np.stack(table[name]) for name in ("observed", "precision")}
        found = cls(type(own[0]), own[0].label, np.array(list(objects), dtype=np.int64), table)
        vars(found)["objects"] = own
        return found

    @classmethod
    def merged(cls, columns: Iterable[Columns]) -> Columns:
        """Return the columns of similar observations, in the order of their rows."""
        objects = {row: one for own in columns for row, one in own.numbered()}
        return cls.of(dict(sorted(objects.items())))

    @cached_property
    def objects(self) -> list[Any]:
        """Observations as objects."""
        found = []
        for values in zip(*self.table.values(), strict=True):
            own = object.__new__(self.kind)
            vars(own).update(zip(self.table, values, strict=True))
            found.append(own)
        return found

    def numbered(self) -> Iterator[tuple[int, Any]]:
        """Yield the row numbers and objects."""
        return zip(self.rows.tolist(), self.objects, strict=True)

    @property
    def key(self) -> tuple[object, ...]:
        """Type and sizes: observations with the same key share columns."""
        return self.kind, self.label, *(len(self.table[name][0]) for name in _SIZES)

    @property
    def moments(self) -> list[Moment | None]:
        """Times on trajectories, instead of photos."""
        none: list[Moment | None] = [None] * len(self.rows)
        if not any(self.table.get("trajectory", none)):
            return none
        return [*map(record_moment, *(self.table[name] for name in ("trajectory", "time", "clock")))]

    def group(
        self, points: Mapping[str, int], photos: Mapping[str, int], unknowns: Mapping[int, int]
    ) -> Group:
        """Return the arrays for the core, with the indices of names, and of unknowns by identity."""
        table, indices = self.table, []
        known: Mapping[Any, int]
        of_unknowns = {one: unknowns[id(one)] for own in set(table["unknowns"]) for one in own if one}
        parts = {"points": points, "photos": photos, "unknowns": {None: -1, **of_unknowns}}
        for name, known in parts.items():
            column: Sequence[tuple[Any, ...]] = table[name]
            try:
                flat = [known[each] for own in column for each in own]
            except KeyError as error:
                row = next(row for row, own in enumerate(column) if error.args[0] in own)
                what = f"observation {self.objects[row].name}"
                raise argument_error(what, "absent", kind=name[:-1], name=error.args[0]) from None
            indices.append(np.array(flat, dtype=np.int64).reshape(len(column), len(column[0])))
        values = self.kind.core_values(np.asarray(table["observed"]), table["unknowns"])
        return self.kind.KIND, indices[0], indices[1], indices[2], values, np.asarray(table["precision"])


class Observations(Sequence[_Row]):
    """Observations of a block in order, stored as columns by type.

    Items are objects, created when one is first used. :meth:`Observation.from_arrays` creates many
    observations of one type. `[*block.observations, Distance(...)]` and `[block.observations, Distance(...)]`
    are observations for another block.
    """

    def __init__(self, columns: Iterable[Columns] = ()) -> None:
        self.columns = sorted(columns, key=lambda each: int(each.rows[0]))
        self._count = sum(len(each.rows) for each in self.columns)

    @classmethod
    def of(cls, parts: Iterable[Any]) -> Observations[Any]:
        """Create the observations of a block from single observations and columns, in order."""
        count = 0
        found: dict[tuple[object, ...], list[Columns]] = {}
        single: dict[tuple[object, ...], dict[int, Any]] = {}
        for part in parts:
            if isinstance(part, Observations):
                for own in part.columns:
                    moved = replace(own, rows=own.rows + count) if count else own
                    found.setdefault(own.key, []).append(moved)
                count += len(part)
            else:
                key = (type(part), part.label, *(len(getattr(part, name)) for name in _SIZES))
                single.setdefault(key, {})[count] = part
                count += 1
        for key, objects in single.items():
            found.setdefault(key, []).append(Columns.of(objects))
        return cls(own[0] if len(own) == 1 else Columns.merged(own) for own in found.values())

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, place: Any) -> Any:
        return self._objects[place]

    def __iter__(self) -> Iterator[_Row]:
        return iter(self._objects)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Observations) and alike(self._objects, other._objects)

    def __hash__(self) -> int:
        return hash(self._count)

    @cached_property
    def _objects(self) -> list[_Row]:
        return self.column("objects")

    @property
    def core_order(self) -> list[int]:
        """Row numbers of the observations in the order of the core: by type."""
        return [row for own in self.columns for row in own.rows.tolist()]

    def column(self, name: str) -> list[Any]:
        """Return a field of all observations in order, e.g. `points`; also `objects` or `moments`."""
        found: list[Any] = [None] * self._count
        for own in self.columns:
            values = getattr(own, name) if name in ("objects", "moments") else own.table[name]
            if len(self.columns) == 1:
                return list(values)
            for row, value in zip(own.rows.tolist(), values, strict=True):
                found[row] = value
        return found

    def of_type(self, kind: type[_Kind]) -> list[_Kind]:
        """Return the observations of one type, in order."""
        columns = [own for own in self.columns if issubclass(own.kind, kind)]
        found = {row: one for own in columns for row, one in own.numbered()}
        return [found[row] for row in sorted(found)]


def moments(observations: Sequence[Any]) -> list[Moment]:
    """Return the different times on trajectories to which observations refer."""
    return list({each.name: each for each in _moments(observations)}.values())


def of_records(observations: Sequence[Any]) -> list[Unknown]:
    """Return the trajectory coefficients and clocks of record times, each once."""
    found: dict[Unknown, None] = {}
    # A trajectory has many records, and possibly many coefficients.
    for trajectory, clock in dict.fromkeys((each.trajectory, each.clock) for each in _moments(observations)):
        found |= dict.fromkeys(one for part in trajectory.coefficients for one in part)
        found |= {} if clock is None else {clock: None}
    return list(found)


def all_trajectories(of_photos: Sequence[Trajectory], observations: Sequence[Any]) -> list[Trajectory]:
    """Return the trajectories of photos, then of records, each once."""
    of_times = (each.trajectory for each in _moments(observations))
    return list(dict.fromkeys([*of_photos, *of_times]))


def _moments(observations: Sequence[Any]) -> Iterable[Moment]:
    """Return the trajectory times of observations."""
    if isinstance(observations, Observations):
        return filter(None, observations.column("moments"))
    return (moment for each in observations if (moment := each.moment) is not None)


def observation_rows(
    observations: Observations[Any],
    points: Sequence[str],
    photos: Sequence[str],
    unknowns: Sequence[Unknown],
) -> list[Group]:
    """Return the arrays for the core of the observations of each type, in `core_order`.

    Record times follow the photos. InputError if a point or photo is not in the block.
    """
    if not observations:
        return []
    all_photos = [*photos, *(each.name for each in moments(observations))]
    of_points, of_photos = ({name: row for row, name in enumerate(each)} for each in (points, all_photos))
    of_unknowns = {id(each): row for row, each in enumerate(unknowns)}
    return [own.group(of_points, of_photos, of_unknowns) for own in observations.columns]
