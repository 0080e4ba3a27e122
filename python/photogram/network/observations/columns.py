"""Observations as columns by type: their rows as objects, and their arrays for the core."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from operator import add
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
        observations = list(objects.values())
        table: dict[str, Any] = {
            field.name: [getattr(one, field.name) for one in observations]
            for field in fields(observations[0])
        }
        table |= {name: np.stack(table[name]) for name in ("observed", "precision")}
        first = observations[0]
        columns = cls(type(first), first.label, np.array(list(objects), dtype=np.int64), table)
        vars(columns)["objects"] = observations
        return columns

    @classmethod
    def merged(cls, columns: Iterable[Columns]) -> Columns:
        """Return the columns of similar observations, in the order of their rows."""
        objects = {row: one for part in columns for row, one in part.numbered()}
        return cls.of(dict(sorted(objects.items())))

    @cached_property
    def objects(self) -> list[Any]:
        return [self._object(values) for values in zip(*self.table.values(), strict=True)]

    def _object(self, values: tuple[Any, ...]) -> Any:
        observation = object.__new__(self.kind)
        vars(observation).update(zip(self.table, values, strict=True))
        return observation

    @property
    def first(self) -> Any:
        return self._object(next(zip(*self.table.values(), strict=False)))

    @property
    def names(self) -> list[str]:
        if self.kind.POINTS:
            return [" - ".join(items) for items in map(add, self.table["points"], self.table["photos"])]
        return [" - ".join(each.of) for each in self.objects]

    def numbered(self) -> Iterator[tuple[int, Any]]:
        return zip(self.rows.tolist(), self.objects, strict=True)

    @property
    def key(self) -> tuple[object, ...]:
        """Type and sizes: observations with the same key share columns."""
        return self.kind, self.label, *(len(self.table[name][0]) for name in _SIZES)

    @cached_property
    def moments(self) -> list[Moment | None]:
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
        of_unknowns = {one: unknowns[id(one)] for row in set(table["unknowns"]) for one in row if one}
        parts = {"points": points, "photos": photos, "unknowns": {None: -1, **of_unknowns}}
        for name, known in parts.items():
            column: Sequence[tuple[Any, ...]] = table[name]
            try:
                flat = [known[one] for row in column for one in row] if column[0] else []
            except KeyError as error:
                number = next(number for number, row in enumerate(column) if error.args[0] in row)
                what = f"observation {self.objects[number].name}"
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
        self.columns = sorted(columns, key=lambda part: int(part.rows[0]))
        self._count = sum(len(part.rows) for part in self.columns)

    @classmethod
    def of(cls, parts: Iterable[Any]) -> Observations[Any]:
        """Create the observations of a block from single observations and columns, in order."""
        count = 0
        by_key: dict[tuple[object, ...], list[Columns]] = {}
        single: dict[tuple[object, ...], dict[int, Any]] = {}
        for part in parts:
            if isinstance(part, Observations):
                for columns in part.columns:
                    moved = replace(columns, rows=columns.rows + count) if count else columns
                    by_key.setdefault(columns.key, []).append(moved)
                count += len(part)
            else:
                key = (type(part), part.label, *(len(getattr(part, name)) for name in _SIZES))
                single.setdefault(key, {})[count] = part
                count += 1
        for key, objects in single.items():
            by_key.setdefault(key, []).append(Columns.of(objects))
        return cls(same[0] if len(same) == 1 else Columns.merged(same) for same in by_key.values())

    def __repr__(self) -> str:
        counts = ", ".join(f"{len(part.rows)} {part.label}" for part in self.columns)
        return f"Observations({counts})"

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
        return [row for columns in self.columns for row in columns.rows.tolist()]

    def column(self, name: str) -> list[Any]:
        """Return a field of all observations in order, e.g. `points`; also `objects` or `moments`."""
        values: list[Any] = [None] * self._count
        for columns in self.columns:
            column = getattr(columns, name) if name in ("objects", "moments") else columns.table[name]
            if len(self.columns) == 1:
                return list(column)
            for row, value in zip(columns.rows.tolist(), column, strict=True):
                values[row] = value
        return values

    def with_point_names(self, new: Mapping[str, str]) -> Observations[_Row]:
        """Return the observations with new names of points, by previous name."""
        found = []
        for columns in self.columns:
            table = {name: [new.get(one, one) for one in columns.table[name]] for name in columns.kind.POINTS}
            points = [tuple(new.get(one, one) for one in row) for row in columns.table["points"]]
            found.append(replace(columns, table={**columns.table, **table, "points": points}))
        return Observations(found)

    def of_type(self, kind: type[_Kind]) -> list[_Kind]:
        """Return the observations of one type, in order."""
        same = [columns for columns in self.columns if issubclass(columns.kind, kind)]
        objects = {row: one for columns in same for row, one in columns.numbered()}
        return [objects[row] for row in sorted(objects)]


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
    if isinstance(observations, Observations):
        return filter(None, observations.column("moments"))
    return (moment for each in observations if (moment := each.moment) is not None)
