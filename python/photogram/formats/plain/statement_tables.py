"""Tables for the accuracy statement: calibrated lengths, cover."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np

from photogram.errors import InputError, message_of
from photogram.formats.plain.schema import ENDS, TABLES
from photogram.formats.plain.tables import Tables, indices_of
from photogram.io.column_table import ColumnTable
from photogram.io.toml import TomlFile
from photogram.messages import counted, unknown_name
from photogram.results.statement.request import Asked
from photogram.words import phrase

COVERS = TABLES["control"].words["cover"]
"""Cover of check points; the first is the default (ASPRS, Edition 2: NVA and VVA)."""


def read_cover(table: ColumnTable, names: Sequence[str], uses: Sequence[str]) -> frozenset[str]:
    """Return the check points in vegetation of a table of control."""
    found = []
    for row, word in enumerate(table.words("cover", COVERS)):
        if word == COVERS[0]:
            continue
        if uses[row] == "control":
            raise table.cell_error(row, "cover", "plain.cover-of-control", point=names[row])
        if uses[row] == "check":
            found.append(names[row])
    return frozenset(found)


def asked_of(tables: Tables, points: Mapping[str, int], vegetated: frozenset[str]) -> dict[str, Any]:
    """Return the arguments of :meth:`photogram.Result.statement` for a project."""
    found, path = dict(tables.settings.statement), tables.settings.path
    for name in found.get("without", ()):
        if name not in points:
            message = phrase("error.at", what="without", message=unknown_name("point", name, points))
            raise TomlFile(path).error(name, message, "statement")
    table, lengths = tables.rows("lengths"), tables.records("lengths")
    table.names("line")
    for end in ENDS:
        indices_of(table, end, points, "point")
    sd = tables.deviations(table, "lengths", ("sd",))
    table.check_given(np.where(np.isinf(sd), np.nan, sd), ("sd",), "lengths")
    for row, cells in enumerate(lengths):
        if cells["from"] == cells["to"]:
            raise table.error(row, phrase("plain.same-ends", name=cells["from"]))
        cells["sd"] = float(sd[row, 0])
    if lengths:
        found["lengths"] = tuple(lengths)
    if vegetated:
        found["vegetated"] = vegetated
    try:
        Asked.checked(**found)
    except InputError as error:
        # Each value was checked with its line: the combination is only rejected without lengths.
        raise TomlFile(path).error("standards", message_of(error), "statement") from None
    return found


def with_cover(
    asked: Mapping[str, Any], points: Collection[str], vegetated: frozenset[str]
) -> dict[str, Any]:
    """Return the settings of a statement with the vegetation cover of a table."""
    rest = {name: own for name, own in asked.items() if name != "vegetated"}
    every = asked.get("vegetated", frozenset()).difference(points) | vegetated
    return {**rest, "vegetated": every} if every else rest


def asked_by_other_names(asked: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    """Return the settings of a statement with renamed points."""

    def rename(name: str) -> str:
        return names.get(name, name)

    changes: dict[str, Callable[[Any], Any]] = {
        "vegetated": lambda own: frozenset(map(rename, own)),
        "without": lambda own: {rename(point): reason for point, reason in own.items()},
        "lengths": lambda own: tuple({**each, **{end: rename(each[end]) for end in ENDS}} for each in own),
        "budgets": lambda own: tuple(_quantity(each, names) for each in own),
    }
    return {key: changes.get(key, lambda same: same)(own) for key, own in asked.items()}


def _quantity(asked: str, names: Mapping[str, str]) -> str:
    """Rename the points of `point C08 z` or `distance C01 C30`."""
    kind, *words = asked.split()
    if kind == "point" and (point := " ".join(words[:-1])) in names:
        return f"point {names[point]} {words[-1]}"
    if kind == "distance":
        for cut in range(1, len(words)):
            ends = " ".join(words[:cut]), " ".join(words[cut:])
            if names.keys() >= set(ends):
                return f"distance {names[ends[0]]} {names[ends[1]]}"
    return asked


def parts_of_asked(asked: Mapping[str, Any]) -> list[str]:
    """Return the parts of the settings of a statement for users."""
    found = []
    if asked.keys() - {"lengths", "vegetated"}:
        found.append("what is asked of an accuracy statement")
    if asked.get("lengths"):
        found.append(counted(len(asked["lengths"]), "calibrated length"))
    if asked.get("vegetated"):
        found.append(f"vegetation about {counted(len(asked['vegetated']), 'check point')}")
    return found
