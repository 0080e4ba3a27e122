"""Shared parameters in rows of tables: one object per name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from photogram.io.column_table import FALSE, TRUE, ColumnTable
from photogram.io.places import at_place
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.unknowns import Unknown

_Made = TypeVar("_Made")
_Kind = TypeVar("_Kind", bound=Unknown)


def made(table: ColumnTable, row: int, make: Callable[..., _Made], *values: Any, **more: Any) -> _Made:
    """Create an object from a row; its errors name the row."""
    with at_place(table.place(row)):
        return make(*values, **more)


def called(cell: str, title: str) -> str:
    """Return the name in a cell: title for `true`, empty for `false`, else the cell."""
    word = cell.lower()
    return title if word in TRUE else "" if word in FALSE else cell


def word_of(unknown: Unknown | None) -> str:
    """Return the cell of an unknown: its name, unless it is a word for true or false."""
    if unknown is None:
        return "false"
    return unknown.title if unknown.name.lower() in TRUE | FALSE else unknown.name


@dataclass(frozen=True)
class Shared:
    """The named unknowns of a project, by type and name."""

    _known: dict[tuple[type[Unknown], str], Unknown] = field(default_factory=dict)

    def one(
        self,
        table: ColumnTable,
        row: int,
        column: str,
        kind: type[_Kind],
        name: str,
        *given: Any,
        **more: Any,
    ) -> _Kind:
        """Return the object of a name, shared by all rows with this name."""
        new = made(table, row, kind, name, *given, **more)
        own = self._known.setdefault((kind, name), new)
        same = own is new or (
            own.row()[1:] == new.row()[1:]
            and own.is_open == new.is_open
            and all(np.array_equal(getattr(own, each), value) for each, value in more.items())
        )
        if not same:
            raise table.cell_error(row, column, "plain.other-values", name=name)
        assert isinstance(own, kind)
        return own
