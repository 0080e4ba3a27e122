"""The table of boards: geometry of the calibration targets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from photogram.formats.plain.schema import BENDS, PITCHES, deviation_columns
from photogram.formats.plain.tables import Tables, columns_of, columns_of_records, made
from photogram.network.block import Block
from photogram.network.passages import Bend, Figure
from photogram.targets.board import Board
from photogram.words import phrase

ASSUMED = "sd of corners assumed"
"""Key of a detail: default standard deviations of corners; levels are ratios."""
REGULARISED = "regularise"  # Detail and column of the weak camera priors of a calibration
TIMES = "times of photos on frames"
"""Key of a detail: clock times in seconds, by names of board photos."""


def read_boards(tables: Tables) -> tuple[dict[str, Board], list[Figure], str | None]:
    """Return the boards, the deflection of boards that have one, and the source of weak camera priors.

    Boards of columns and rows have their own points; others use control points, which are read later.
    """
    table, records = tables.rows("boards"), tables.records("boards", defaults=True)
    if table.count > 1:
        raise table.error(1, phrase("plain.several-boards", count=table.count))
    boards, bends = dict[str, Board](), list[Figure]()
    for row, cells in enumerate(records):
        name, alone = cells["board"], cells["kind"] == "points"
        fields = ("kind", "shape") if alone else ("kind", "shape", "columns", "rows", *PITCHES[2:])
        given: dict[str, Any] = {field: cells[field] for field in fields if field in cells}
        if alone:
            given["points"] = np.zeros((0, 3))
        elif "tag_size" not in given:
            given["spacing"] = tuple(cells.get(field, np.nan) for field in PITCHES[:2])
        boards[name] = own = made(table, row, Board, unit=tables.settings.length, **given)
        if own.shape == "bend":
            values, sd = ([cells[field] for field in part] for part in (BENDS, deviation_columns(BENDS)))
            bends.append(Figure(Bend(name, values, sd), own.names, own.shifts()))
    return boards, bends, records[0].get(REGULARISED) if records else None


def boards_table(boards: Mapping[str, Board], block: Block, regularise: str | None) -> dict[str, Any]:
    bends = {own.bend.name: own.bend for own in block.passages if isinstance(own, Figure)}
    rows = []
    for name, own in boards.items():
        cells: dict[str, Any] = {"board": name, "kind": own.kind}
        if own.kind != "points":
            cells |= {"columns": own.columns, "rows": own.rows}
            cells |= {} if own.tag_size else columns_of(PITCHES[:2], np.array(own.pitch))
        cells |= {"tag_size": own.tag_size, "tag_spacing": own.tag_spacing, "shape": own.shape}
        cells[REGULARISED] = regularise
        if name in bends:
            cells |= columns_of(BENDS, bends[name].position[:2])
            cells |= columns_of(deviation_columns(BENDS), bends[name].deviations[:2])
        rows.append(cells)
    return columns_of_records(rows)
