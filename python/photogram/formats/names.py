"""Point names (`names.csv`) for formats with numbers, and values by name."""

from __future__ import annotations

from collections import UserDict
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np

from photogram.arguments.types import Indices
from photogram.formats.plain.statement_tables import asked_by_other_names
from photogram.formats.plain.tables import indices_of
from photogram.formats.project import Project
from photogram.io.csv_text import csv_text
from photogram.io.delimited import read_columns
from photogram.lazy_dataclasses import replace
from photogram.messages import Message
from photogram.words import phrase

NAMES = "names.csv"
LARGEST = 2**53
T = TypeVar("T")


def with_names(project: Project, path: Path) -> Project:
    """Return a project with point names from a table `point`, `name`."""
    table = read_columns(path, known=("point", "name"))
    table.require("point", "name")
    old = project.block.point_ids
    rows = indices_of(table, "point", {name: row for row, name in enumerate(old)}, "point")
    names = table.texts("name")
    table.names("name")
    new = {old[place]: name for place, name in zip(rows.tolist(), names, strict=True)}
    taken: dict[str, int] = {}
    for row, name in enumerate(new.get(name, name) for name in old):
        if taken.setdefault(name, row) != row:
            raise table.error(names.index(name), phrase("format.repeated", what="point", name=name))
    message = Message.of("format.renamed", path, n=len(rows), file=path.name)
    return with_other_names(project, new).replace(messages=(*project.messages, message))


def with_other_names(project: Project, new: Mapping[str, str]) -> Project:
    """Return a project with new point names, by previous name; all names must differ."""
    old = project.block.point_ids
    ids = [new.get(name, name) for name in old]
    colours, numbers = (project.details.get(key, {}) for key in ("colours", "point numbers"))
    first = [numbers.get(name, name) for name in old]
    details = {
        **project.details,
        "colours": {new.get(point, point): colour for point, colour in colours.items()},
        "point numbers": {own: name for own, name in zip(ids, first, strict=True) if name.isdigit()},
    }
    again = project.repeated
    observations = project.block.observations.with_point_names(new)
    features = project.features.items()
    return project.replace(
        block=project.block.replace(point_ids=ids, observations=observations),
        details=details,
        features={name: (kind, [new.get(own, own) for own in points]) for name, (kind, points) in features},
        statement=asked_by_other_names(project.statement, new),
        repeated=replace(again, points=tuple(new.get(point, point) for point in again.points)),
        tracks=project.tracks.difference(new),
    )


def read_names(path: Path) -> dict[str, str]:
    """Return names by number from a table `number`, `name`; empty without file."""
    if not path.is_file():
        return {}
    table = read_columns(path, known=("number", "name"))
    table.require("number", "name")
    names = dict(zip(table.names_once("number"), table.texts("name"), strict=True))
    for row, (number, name) in enumerate(names.items()):
        if not name:
            raise table.error(row, phrase("format.name", what="number", name=number))
    return names


def numbered(names: Sequence[str], known: Mapping[str, str | int] | None = None) -> dict[str, int]:
    """Return a number for each name: known, its own, otherwise 1, 2, ..."""
    if known is not None and all(name in known for name in names):
        return {name: int(known[name]) for name in names}
    if all(name.isascii() and name.isdigit() and str(int(name)) == name for name in names):
        numbers = {name: int(name) for name in names}
        if max(numbers.values(), default=0) < LARGEST:
            return numbers
    return {name: number for number, name in enumerate(names, 1)}


def names_file(numbers: Mapping[str, int], heading: str = "point") -> dict[str, bytes]:
    """Return the table of names by number, unless all names are their numbers."""
    if all(str(number) == name for name, number in numbers.items()):
        return {}
    return {NAMES: csv_text({heading: list(numbers.values()), "name": list(numbers)})}


class NamedValues(UserDict[str, T]):
    """Values by name, in a dictionary that is created on demand."""

    def __init__(self, names: Sequence[str], values: Indices | Sequence[T]) -> None:
        self._names, self._values = names, values

    @cached_property
    def data(self) -> dict[str, T]:  # type: ignore[override]
        return dict(zip(self._names, np.asarray(self._values).tolist(), strict=True))
